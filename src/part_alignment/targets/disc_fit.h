// Fits a blurred elliptic disc to the pixels about its edge, and an ellipse to points.
#pragma once

#include <array>
#include <cmath>
#include <cstddef>
#include <numbers>
#include <optional>
#include <span>

#include "base/page.h"
#include "part_alignment/targets/image_ellipse.h"

namespace trammel::part_alignment {

/// Disc whose grey value at p is gain · (background + contrast · coverage(p)), gain = 1 + gradient
/// · (p - c). The edge is |W (p - c)| = 1 with W symmetric, its profile a Gaussian's integral.
struct DiscModel {
  double column_px = 0;  ///< c
  double row_px = 0;
  double wxx = 0;  ///< W, 1/px
  double wxy = 0;
  double wyy = 0;
  double blur_px = 0.8;
  double contrast = 0;  ///< grey levels: disc less surroundings
  double background = 0;
  double gradient_x = 0;  ///< 1/px, relative
  double gradient_y = 0;
};

/// Cover of each direction by a ring's segments, as sharp as drawn; in 0 … 1. Directions: kAngles
/// even steps of the angle of W (p - c). All 0: no ring.
struct RingShade {
  static constexpr int kAngles = 128;
  std::array<float, kAngles> cover{};
};

struct DiscFit {
  DiscModel model;
  double sigma_column_px = 0;
  double sigma_row_px = 0;
  double noise = 0;  ///< rms residual, grey levels, at least that of rounding to 8 bits
  int samples = 0;
  int saturated = 0;
};

/// Returns the edge |W (p - c)| = 1.
[[nodiscard]] ImageEllipse EllipseOf(const DiscModel& model);

/// Returns the radius of the circle of the same area, px.
[[nodiscard]] double MeanRadius(const DiscModel& model);

/// Fits by Gauss-Newton from `start`, which must be right to about a pixel. Absent if it does not
/// converge, or too few pixels are inside the picture and below saturation.
/// @param picture  1 channel.
[[nodiscard]] std::optional<DiscFit> FitDisc(const PageView& picture, const DiscModel& start,
                                             const RingShade& ring);

struct Offset {
  double x = 0;
  double y = 0;
};

/// Fits an ellipse to points about (0, 0), by the conic's algebraic residual. Sets only centre and
/// shape of the model.
/// @param scale  approximate distance of the points from (0, 0), px.
[[nodiscard]] std::optional<DiscModel> EllipseThrough(std::span<const Offset> points, double scale);

/// Computes the approximate root mean square of the points' distances from the ellipse.
[[nodiscard]] double DistanceFrom(const DiscModel& ellipse, std::span<const Offset> points);

/// Returns kCount directions at even steps of the angle, all around.
/// @param stride  from each to the next, in steps; without a divisor of kCount
template <std::size_t kCount>
std::array<Offset, kCount> AllAround(double first_rad, int stride = 1) {
  std::array<Offset, kCount> all;
  for (std::size_t i = 0; i < kCount; ++i) {
    const double angle =
        first_rad + 2 * std::numbers::pi * stride * static_cast<double>(i) / kCount;
    all[i] = {std::cos(angle), std::sin(angle)};
  }
  return all;
}

}  // namespace trammel::part_alignment
