// The value at a place in the order of some few.
#pragma once

#include <array>
#include <cstddef>

namespace trammel::part_alignment {

/// Of the first `count` values the one that `place` others go before, from how many are below each:
/// where a search would guess wrong half of the time, only the end of this depends on them.
/// REQUIRES place < count.
template <typename Value, std::size_t kMost>
[[nodiscard]] Value InOrder(const std::array<Value, kMost>& values, std::size_t count,
                            std::size_t place) {
  for (std::size_t i = 0; i < count; ++i) {
    const Value value = values[i];
    unsigned below = 0;
    unsigned alike = 0;
    for (std::size_t k = 0; k < count; ++k) {
      below += values[k] < value ? 1 : 0;
      alike += values[k] == value ? 1 : 0;
    }
    if ((below <= place) & (place < below + alike)) return value;
  }
  return {};
}

}  // namespace trammel::part_alignment
