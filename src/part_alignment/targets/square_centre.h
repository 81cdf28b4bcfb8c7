// The centre of a square marker from its four edges.
#pragma once

#include <array>

#include "part_alignment/targets/square_edge.h"
#include "part_alignment/targets/square_shape.h"

namespace trammel::part_alignment {

struct SquareCentre {
  std::array<ImagePoint, 4> corners{};  ///< [k]: where edge k - 1 meets edge k
  ImagePoint centre;
  double sigma_column_px = 0;  ///< k = 1
  double sigma_row_px = 0;
  /// Factor on all sigmas for what is not independent from pixel to pixel (ragged edges), >= 1.
  double unevenness = 1;
};

/// @param edges  clockwise, neighbours at an angle. Their errors are taken to be independent.
[[nodiscard]] SquareCentre CentreOf(const std::array<EdgeFit, 4>& edges);

}  // namespace trammel::part_alignment
