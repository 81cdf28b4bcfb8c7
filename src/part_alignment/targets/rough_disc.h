// A disc's ellipse from its middle, by rays.
#pragma once

#include <optional>

#include "base/page.h"
#include "part_alignment/targets/blob_search.h"
#include "part_alignment/targets/disc_fit.h"

namespace trammel::part_alignment {

/// The ellipse through where rays from the middle cross half the contrast, as a start for FitDisc.
/// Absent where they do not lie on one, or the contrast is less.
/// @param dark  whether the disc is darker than what is about it.
[[nodiscard]] std::optional<DiscModel> RoughDisc(const PageView& picture, const Middle& middle,
                                                 bool dark, double min_contrast);

}  // namespace trammel::part_alignment
