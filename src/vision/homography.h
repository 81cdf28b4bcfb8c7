// The projective map between a plane (the plate) and its picture.
#pragma once

#include <array>
#include <optional>

#include "vision/image.h"

namespace trammel::vision {

/// Row-major 3 x 3 matrix, up to scale.
struct Homography {
  std::array<double, 9> m = {1, 0, 0, 0, 1, 0, 0, 0, 1};

  [[nodiscard]] PointPx operator()(const PointPx& point) const;
};

/// The map that takes the four corners of `source` to those of `target`, exactly.
/// @returns nothing where three corners of either lie on one line.
[[nodiscard]] std::optional<Homography> TargetFromSource(const Quad& target, const Quad& source);

/// Whether the four corners, in their order, go round a convex area.
[[nodiscard]] bool IsConvex(const Quad& quad);

/// Without sign, in px^2.
[[nodiscard]] double Area_px2(const Quad& quad);

[[nodiscard]] double Distance_px(const PointPx& a, const PointPx& b);

}  // namespace trammel::vision
