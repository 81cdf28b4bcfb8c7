// A JPEG's entropy-coded data, without the bytes that keep them from looking like markers.
#pragma once

#include <bit>
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <span>
#include <vector>

namespace trammel::image {

/// The bits up to the first marker, at any place in them. Behind their end are zeros.
class EntropyData {
 public:
  /// Takes the bits of bytes that begin behind a scan's header.
  void Start(std::span<const std::uint8_t> bytes);

  [[nodiscard]] std::size_t size_bit() const { return size_bit_; }

  static constexpr std::size_t kReach_bit = 64;

  /// The next 57 bits or more, the first of them highest. REQUIRES a place no further
  /// behind the end than kReach_bit.
  [[nodiscard]] std::uint64_t Look(std::size_t at_bit) const {
    std::uint64_t next = 0;
    std::memcpy(&next, bytes_.data() + at_bit / 8, sizeof next);
    if constexpr (std::endian::native == std::endian::little) next = __builtin_bswap64(next);
    return next << (at_bit % 8);
  }

 private:
  std::vector<std::uint8_t> bytes_;
  std::size_t size_bit_ = 0;
};

/// Reads the bits front to back, as EntropyBits does those of a file. A value, so that a loop can
/// keep it in registers.
class EntropyDataBits {
 public:
  /// REQUIRES that the data outlive it, unchanged.
  EntropyDataBits(const EntropyData& data, std::size_t at_bit) : data_(&data), at_bit_(at_bit) {}

  static constexpr int kReady_bit = 56;

  void Fill() { bits_ = RanOut() ? 0 : data_->Look(at_bit_); }
  [[nodiscard]] std::uint64_t Look() const { return bits_; }
  void Skip(int count) {
    bits_ <<= count;
    at_bit_ += static_cast<std::size_t>(count);
  }
  [[nodiscard]] bool RanOut() const { return at_bit_ > data_->size_bit(); }
  [[nodiscard]] std::size_t at_bit() const { return at_bit_; }

  /// Never: the data end before a marker.
  [[nodiscard]] static bool PassRestart(int) { return false; }

 private:
  const EntropyData* data_;
  std::size_t at_bit_;
  std::uint64_t bits_ = 0;
};

}  // namespace trammel::image
