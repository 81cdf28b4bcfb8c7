// The edges of a CAD part that a drawing of it may need.
#pragma once

#include <Eigen/Core>
#include <vector>

#include "part_alignment/part_fit/part_fit.h"

namespace trammel::report {

/// Between two triangles, in the ideal part's frame.
struct OutlineEdge {
  Eigen::Vector3d from_mm;
  Eigen::Vector3d to_mm;
  Eigen::Vector3d normal;
  Eigen::Vector3d other_normal;  ///< the opposite one at the rim of an open shell
  bool sharp = false;            ///< an edge of the part, seen wherever one of its sides is
};

/// Sharp edges of all meshes, and those smooth ones that are outlines along one of the six
/// directions of the axes.
[[nodiscard]] std::vector<OutlineEdge> OutlineOf(const part_alignment::PartFitInput& input);

}  // namespace trammel::report
