// Which taps are at one place of the bed.
#pragma once

#include <cstddef>
#include <span>
#include <vector>

#include "tap/ensemble/ensemble.h"

namespace trammel::tap {

/// Groups the indices of good taps by place, in the order of their first tap. Taps that say no
/// place are at one place together. Cost: O(n log n).
[[nodiscard]] std::vector<std::vector<std::size_t>> GroupByPlace(std::span<const TapResult> taps,
                                                                 double same_place_mm);

}  // namespace trammel::tap
