// A block with a bore, and perhaps a freeform top, as the text of a STEP file: written here, by no
// CAD program.
#pragma once

#include <Eigen/Core>
#include <array>
#include <string>
#include <string_view>
#include <vector>

namespace trammel::test {

/// About the middle of its bottom; the bore runs along y.
struct StepBlock {
  Eigen::Vector3d size_mm = {80, 50, 30};
  double bore_radius_mm = 8;
  double bore_x_mm = -18;
  double bore_z_mm = 13;
  bool freeform = false;  ///< the top is a bicubic B-spline surface instead of a plane
  std::string name = "block";
  Eigen::Vector3d at_mm = Eigen::Vector3d::Zero();
};

enum class StepFault {
  kNone,
  kNoTop,         ///< a shell that is said to be closed and is not
  kSurfacesOnly,  ///< an open shell of faces, and no solid
};

/// @param unit  "mm", "cm", "m" or "inch"
[[nodiscard]] std::string StepText(const std::vector<StepBlock>& solids, std::string_view unit,
                                   StepFault fault = StepFault::kNone);

/// The freeform top over a place, both from 0 to 1 of the block's length and width.
struct TopPoint {
  Eigen::Vector3d at_mm;
  Eigen::Vector3d outward;  ///< unit vector
};
[[nodiscard]] TopPoint TopAt(const StepBlock& block, double u, double v);

}  // namespace trammel::test
