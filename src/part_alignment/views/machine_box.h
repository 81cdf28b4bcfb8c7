#pragma once

#include <Eigen/Core>

namespace trammel::part_alignment {

/// Box along the machine's axes, in its coordinates: its travel, a part, a clamp, the fixture.
struct MachineBox {
  Eigen::Vector3d low_mm = Eigen::Vector3d::Zero();
  Eigen::Vector3d high_mm = Eigen::Vector3d::Zero();
};

}  // namespace trammel::part_alignment
