// Entropy-coded data of a JPEG, written with a table of its own for DC differences.
#pragma once

#include <bit>
#include <cstddef>
#include <cstdint>
#include <cstdlib>
#include <vector>

namespace trammel::image {

// Of the table for DC differences of up to 11 bits: codes of four bits, the size itself.
inline constexpr int kWrittenDcCode_bit = 4;
inline constexpr int kWrittenDc_bit = 11;

/// Writes bits behind bytes, and between them what keeps them from looking like markers.
class EntropyWriter {
 public:
  explicit EntropyWriter(std::vector<std::uint8_t>& bytes) : bytes_(bytes) {}

  /// @param bits  right-aligned, `count` of them, at most 31; nothing above them.
  void Put(std::uint64_t bits, int count) {
    held_ = held_ << count | bits;
    count_ += count;
    while (count_ >= 8) {
      count_ -= 8;
      const auto byte = static_cast<std::uint8_t>(held_ >> count_);
      bytes_.push_back(byte);
      if (byte == 0xFF) bytes_.push_back(0);
    }
  }

  /// False where there is no code for the difference.
  [[nodiscard]] bool PutDc(int difference) {
    constexpr int kMost = (1 << kWrittenDc_bit) - 1;
    if (difference < -kMost || difference > kMost) return false;
    const int size = std::bit_width(static_cast<unsigned>(std::abs(difference)));
    const int number = difference < 0 ? difference + (1 << size) - 1 : difference;
    Put(static_cast<std::uint64_t>(size << size | number), kWrittenDcCode_bit + size);
    return true;
  }

  /// Fills the last byte up with ones.
  void Finish() { Put(0x7F, 7); }

 private:
  std::vector<std::uint8_t>& bytes_;
  std::uint64_t held_ = 0;
  int count_ = 0;
};

}  // namespace trammel::image
