#include "image/entropy_data.h"

#include <algorithm>

namespace trammel::image {
namespace {

constexpr std::uint8_t kMark = 0xFF;
constexpr std::size_t kChunk = 32;

/// Copies bytes up to the first kMark, and mostly some behind it.
/// @returns how many are before it.
std::size_t CopyUnmarked(std::span<const std::uint8_t> from, std::uint8_t* to) {
  for (std::size_t at = 0;; at += kChunk) {
    const std::size_t count = std::min(kChunk, from.size() - at);
    std::uint8_t marked = 0;
    if (count == kChunk) [[likely]] {
      for (std::size_t i = 0; i < kChunk; ++i) marked |= from[at + i] == kMark ? 1 : 0;
      std::memcpy(to + at, from.data() + at, kChunk);
      if (marked == 0) continue;
    } else if (count > 0) {
      std::memcpy(to + at, from.data() + at, count);
    }
    if (count == 0) return at;
    const void* mark = std::memchr(from.data() + at, kMark, count);
    if (mark == nullptr) return at + count;
    return static_cast<std::size_t>(static_cast<const std::uint8_t*>(mark) - from.data());
  }
}

}  // namespace

void EntropyData::Start(std::span<const std::uint8_t> bytes) {
  constexpr std::size_t kBehind = kReach_bit / 8 + sizeof(std::uint64_t);
  if (bytes_.size() < bytes.size() + kBehind) bytes_.resize(bytes.size() + kBehind);
  std::uint8_t* to = bytes_.data();
  while (!bytes.empty()) {
    const std::size_t count = CopyUnmarked(bytes, to);
    to += count;
    bytes = bytes.subspan(count);
    if (bytes.size() < 2 || bytes[1] != 0) break;  // a marker
    *to++ = kMark;
    bytes = bytes.subspan(2);
  }
  size_bit_ = 8 * static_cast<std::size_t>(to - bytes_.data());
  std::fill_n(to, kBehind, std::uint8_t{0});
}

}  // namespace trammel::image
