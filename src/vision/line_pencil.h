// Equally spaced parallel lines of a plane, as a camera sees them.
#pragma once

#include <array>
#include <optional>
#include <span>

#include "vision/image.h"

namespace trammel::vision {

/// A pencil of image lines, each ax + by + c = 0 with (a, b, c) = first + place * step: what equal
/// steps on the plane become in a picture. `step` is the plane's horizon. Places need not be whole.
struct LinePencil {
  std::array<double, 3> first = {0, -1, 0};  ///< the line of place 0, b = -1
  std::array<double, 3> step = {0, 0, 1};

  /// y of a place's line at x; infinite or of the wrong sign beyond the horizon.
  [[nodiscard]] double Y_px(double place, double x_px) const;
  /// The place whose line goes through a point.
  [[nodiscard]] double PlaceOf(const PointPx& point) const;
  /// Whether the plane between two places and two columns lies on one side of the horizon.
  [[nodiscard]] bool Sees(double first_place, double last_place, double left_px,
                          double right_px) const;
};

/// A point on the line of a place.
struct PencilPoint {
  PointPx at;
  double place = 0;
};

/// Algebraic least squares. REQUIRES lines that run along the rows rather than the columns.
/// @returns nothing where the points lie on fewer than three lines or do not settle the pencil.
[[nodiscard]] std::optional<LinePencil> FitPencil(std::span<const PencilPoint> points);

}  // namespace trammel::vision
