// Squares in pictures.
#pragma once

#include <array>
#include <cmath>

namespace trammel::part_alignment {

/// A place in the picture, px. (0, 0) is the centre of the first pixel.
struct ImagePoint {
  double x = 0;  ///< column
  double y = 0;  ///< row
};

[[nodiscard]] inline double Distance(const ImagePoint& a, const ImagePoint& b) {
  return std::hypot(a.x - b.x, a.y - b.y);
}

/// The outline of a square marker as it appears.
struct SquareShape {
  /// Where straight lines along the edges meet: the marker's upper left corner, then the upper
  /// right, lower right and lower left one as one looks at it upright.
  std::array<ImagePoint, 4> corners{};
  /// By how much the middle of the edge from corner i to the next lies beyond the line through its
  /// ends; < 0: short of it.
  std::array<double, 4> bows_px{};
  double bow_sigma_px = 0;  ///< k = 1, the largest of the four
};

/// Where the diagonals from corner 0 to 2 and 1 to 3 cross, which is the image of the square's
/// middle in every perspective. REQUIRES that they are not parallel.
[[nodiscard]] inline ImagePoint CrossingOfDiagonals(const std::array<ImagePoint, 4>& corners) {
  const ImagePoint& a = corners[0];
  const ImagePoint u{corners[2].x - a.x, corners[2].y - a.y};
  const ImagePoint v{corners[3].x - corners[1].x, corners[3].y - corners[1].y};
  const ImagePoint w{corners[1].x - a.x, corners[1].y - a.y};
  const double along = (w.x * v.y - w.y * v.x) / (u.x * v.y - u.y * v.x);
  return {a.x + along * u.x, a.y + along * u.y};
}

}  // namespace trammel::part_alignment
