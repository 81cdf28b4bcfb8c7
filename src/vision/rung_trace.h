// One line across a rectified picture, looked at in pieces.
#pragma once

#include <optional>
#include <vector>

#include "vision/image.h"
#include "vision/line_pattern.h"

namespace trammel::vision {

/// Means over up to `half` values to either side.
[[nodiscard]] std::vector<double> BoxMean(const std::vector<double>& values, int half);

/// What stands out across a line, seen over some columns.
struct RungSection {
  double middle_px = 0;  ///< y
  double width_px = 0;   ///< at half height
  double height = 0;     ///< contrast above the plate beside
};

/// Mean over the columns x_begin … x_end of what lies within half a pitch of a place.
/// @returns nothing where nothing stands out, or less than 4 px can be looked at.
[[nodiscard]] std::optional<RungSection> SectionOfRung(const GrayImage& image, int x_begin,
                                                       int x_end, double y_near, double pitch_px);

/// Mean brightness along the middle between two rungs, one per column.
[[nodiscard]] std::vector<double> BetweenRungs(const GrayImage& image, const Curve& above,
                                               const Curve& below, double pitch_px);

}  // namespace trammel::vision
