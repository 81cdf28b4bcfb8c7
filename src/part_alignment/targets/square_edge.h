// One edge of a square marker: a straight, blurred step from black to white, fitted to the pixels.
#pragma once

#include <array>
#include <optional>

#include "base/page.h"
#include "part_alignment/targets/square_shape.h"

namespace trammel::part_alignment {

/// What is known of an edge beforehand. All lengths in px; corners clockwise, so that what is white
/// lies on the left hand from `from` to `to`.
struct EdgeStart {
  ImagePoint from;  ///< corners, right to about a pixel
  ImagePoint to;
  ImagePoint before;  ///< the corner before `from`
  ImagePoint after;   ///< the corner after `to`
  /// Corners of the modules behind the border, seen along the edge: from behind the first module's
  /// end to behind the last but one's.
  std::array<ImagePoint, 6> behind{};
  std::array<bool, 5> white_behind{};  ///< the modules between them
  double outer_px = 0;                 ///< of the white before the edge that is certain
  double blur_px = 0.8;
  double bright = 0;  ///< grey levels
  double dark = 0;
  double light_x = 0;  ///< change of brightness by place, 1/px, relative
  double light_y = 0;
  bool rough = false;  ///< a few rows or columns of it, to a fiftieth of a pixel
};

/// The line n · (p - middle) = 0, n outwards.
struct EdgeFit {
  ImagePoint middle;
  ImagePoint outwards;        ///< n, a unit vector
  double half_length_px = 0;  ///< of what was fitted
  /// Variances (px²) of the line's place along n in its middle, and at an end relative to that, and
  /// what they share: from the pixels' scatter about the model, taken as independent.
  double var_middle = 0;
  double var_end = 0;
  double covariance = 0;
  /// How the places of short parts of the edge scatter about it, as a sum of squares in units of
  /// what var_middle and its like say, and the number of parts that are free to: of the order of it
  /// where neighbouring pixels are independent, more for a ragged edge.
  double scatter = 0;
  int scatter_free = 0;
  double noise = 0;  ///< rms residual, grey levels, at least that of rounding to 8 bits
  double blur_px = 0;
  double bright = 0;
  double dark = 0;
  double bow_px = 0;  ///< by which the edge's middle is farther out than the line through its ends
  double bow_sigma_px = 0;  ///< of independent pixels
  int samples = 0;
  int saturated = 0;  ///< of these, beyond what the sensor shows, so that they tell nothing
};

/// Gauss-Newton over place, direction, blur and both sides' shades, which may change along the
/// edge. Absent where it does not settle near its start.
/// @param picture  1 channel.
[[nodiscard]] std::optional<EdgeFit> FitSquareEdge(const PageView& picture, const EdgeStart& start);

}  // namespace trammel::part_alignment
