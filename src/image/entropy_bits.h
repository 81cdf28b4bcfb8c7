// The bits of a JPEG's entropy-coded data, without the bytes that keep them from looking like
// markers.
#pragma once

#include <bit>
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <span>

namespace trammel::image {

/// Reads bits front to back up to a marker, where zeros follow. A value, so that a loop can keep it
/// in registers.
class EntropyBits {
 public:
  /// REQUIRES that the bytes, which begin behind a scan's header, outlive it.
  explicit EntropyBits(std::span<const std::uint8_t> bytes)
      : at_(bytes.data()), end_(bytes.data() + bytes.size()) {}

  static constexpr int kReady_bit = 56;

  /// Makes the next kReady_bit bits ready. Behind the data's end they are zeros.
  void Fill();

  /// The bits that come next, the first of them highest: those that are ready, then others.
  [[nodiscard]] std::uint64_t Look() const { return bits_; }

  /// REQUIRES that no more are skipped than are ready.
  void Skip(int count) {
    bits_ <<= count;
    left_ -= count;
  }

  /// Whether more was skipped than there is before the marker.
  [[nodiscard]] bool RanOut() const { return left_ < made_up_; }

  /// Goes behind the restart marker of this number, 0 … 7; false where no more than the filled-up
  /// rest of a byte stands before it, or another marker, or where the data ran out.
  [[nodiscard]] bool PassRestart(int number) {
    const bool here = left_ >= made_up_ && left_ - made_up_ < 8 && end_ - at_ >= 2 &&
                      at_[0] == 0xFF && at_[1] == 0xD0 + number;
    if (!here) return false;
    at_ += 2;
    bits_ = 0;
    left_ = made_up_ = 0;
    return true;
  }

 private:
  static void FillByByte(EntropyBits& bits);

  const std::uint8_t* at_;
  const std::uint8_t* end_;
  std::uint64_t bits_ = 0;
  int left_ = 0;     // of bits_, made up or not
  int made_up_ = 0;  // of those, behind the data's end
};

inline void EntropyBits::Fill() {
  if (end_ - at_ >= 8) [[likely]] {
    std::uint64_t next = 0;
    std::memcpy(&next, at_, sizeof next);
    constexpr std::uint64_t kOnes = 0x0101010101010101;
    const bool stuffed = ((~next - kOnes) & next & (kOnes << 7)) != 0;  // a byte is 0xFF
    if (!stuffed) [[likely]] {
      if constexpr (std::endian::native == std::endian::little) next = __builtin_bswap64(next);
      // Bits beyond those counted are the next byte's, which adds them once more.
      bits_ |= next >> left_;
      at_ += (63 - left_) >> 3;
      left_ |= 56;
      return;
    }
  }
  // Member by member, as compilers keep what is copied whole in memory.
  EntropyBits filled({at_, end_});
  filled.bits_ = bits_;
  filled.left_ = left_;
  filled.made_up_ = made_up_;
  FillByByte(filled);
  at_ = filled.at_;
  bits_ = filled.bits_;
  left_ = filled.left_;
  made_up_ = filled.made_up_;
}

}  // namespace trammel::image
