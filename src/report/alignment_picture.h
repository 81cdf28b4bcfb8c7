// A picture of a part with what was found in it and where the solution has it.
#pragma once

#include <Eigen/Core>
#include <optional>
#include <string>
#include <vector>

#include "base/frame.h"
#include "report/pressure_advance_figures.h"

namespace trammel::report {

/// One target in one view; found, projected, or both.
struct DrawnTarget {
  std::string id;
  std::optional<Eigen::Vector2d> found_px;      ///< (column, row)
  std::optional<Eigen::Vector2d> projected_px;  ///< where the solution has it
  bool left_out = false;                        ///< taken for wrong, so that it did not count
};

/// "view000" and so on: the picture at `width_px` of the page, a circle where each target was
/// found, a cross where the solution projects it, and the residual between them 500 times enlarged
/// with its size beside it. Red circle: left out; dashed cross: in the picture, but not found.
/// @param picture  without pixels: a grey area in its place.
/// @param width_px, height_px  of the camera, >= 1
[[nodiscard]] Figure AlignmentPicture(std::size_t view, const BgrView& picture, int width_px,
                                      int height_px, const std::vector<DrawnTarget>& targets);

}  // namespace trammel::report
