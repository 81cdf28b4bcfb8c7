// A blurred elliptic disc, fitted to the pixels about its edge.
#pragma once

#include <array>
#include <optional>

#include "base/page.h"
#include "part_alignment/targets/image_ellipse.h"

namespace trammel::part_alignment {

/// Grey value at p: gain · (background + contrast · coverage(p)), gain = 1 + gradient · (p - c).
/// The edge is |W (p - c)| = 1 with W symmetric, its profile a Gaussian's integral.
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

/// How much of a ring's segments covers a direction, at kAngles even steps of the angle of W (p -
/// c) and as sharp as drawn; in 0 … 1. All 0: no ring.
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

/// The edge |W (p - c)| = 1.
[[nodiscard]] ImageEllipse EllipseOf(const DiscModel& model);

/// Radius of the circle of the same area, px.
[[nodiscard]] double MeanRadius(const DiscModel& model);

/// Gauss-Newton from `start`, which must be right to about a pixel. Absent where it does not
/// settle, or too few pixels are inside the picture and below saturation.
/// @param picture  1 channel.
[[nodiscard]] std::optional<DiscFit> FitDisc(const PageView& picture, const DiscModel& start,
                                             const RingShade& ring);

}  // namespace trammel::part_alignment
