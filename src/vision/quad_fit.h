// Quadrilaterals from outlines.
#pragma once

#include <optional>
#include <vector>

#include "vision/homography.h"
#include "vision/image.h"

namespace trammel::vision {

/// The quadrilateral round a convex polygon, found by dropping the side whose neighbours close over
/// it with the least extra area until four are left.
/// @param polygon  convex, in order, at least four corners.
/// @returns clockwise as seen; nothing where the polygon has too few sides that can be dropped.
[[nodiscard]] std::optional<Quad> QuadAround(std::vector<PointPx> polygon);

struct RefinedQuad {
  Quad quad;
  double closed = 0;  ///< share of the worst side with an outline within tolerance
};

/// Moves each side of a quadrilateral onto the outline of a mask: the places where, coming from
/// outside, the mask begins, fitted by a straight line that ignores outliers.
/// @param mask     1 inside, 0 outside.
/// @returns nothing where the sides cannot be fitted.
[[nodiscard]] std::optional<RefinedQuad> RefineQuad(const GrayImage& mask, const Quad& start);

}  // namespace trammel::vision
