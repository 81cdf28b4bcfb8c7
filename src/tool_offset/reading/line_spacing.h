// How far apart the lines of a nested box are, in pixels: the scale of a sheet of unknown size.
#pragma once

#include <array>
#include <optional>

#include "tool_offset/reading/page.h"

namespace trammel::tool_offset {

/// Looks across the sides of a box for the distance after which its lines repeat.
/// @param mix         ink is higher than paper.
/// @param corners     of the box, in order, page pixels; right to `slack_px`.
/// @param lowest_px, highest_px  the range of distances to look in.
/// @returns nothing where no lines repeat.
/// Accuracy: about 1 % (sheet_finder_test reads codes with it, which need 1 %).
[[nodiscard]] std::optional<double> LineSpacing_px(const PageView& page, const ChannelMix& mix,
                                                   const std::array<PagePoint, 4>& corners,
                                                   double slack_px, double lowest_px,
                                                   double highest_px);

}  // namespace trammel::tool_offset
