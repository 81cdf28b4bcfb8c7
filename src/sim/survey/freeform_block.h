// A block with plane sides and a freeform top, known exactly.
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <vector>

namespace trammel::sim {

/// A hill of the top, Gaussian.
struct BlockHill {
  Eigen::Vector2d at_mm = Eigen::Vector2d::Zero();
  double height_mm = 0;
  double width_mm = 100;  ///< 1 sigma
};

/// Origin amid the top's plane, which the hills rise from; sides at +-half, down to -depth.
struct FreeformBlock {
  double half_length_mm = 1000;
  double half_width_mm = 600;
  double depth_mm = 400;
  std::vector<BlockHill> hills;
};

/// Seven hills drawn, broad and steep ones, up to 120 mm high.
[[nodiscard]] FreeformBlock DrawBlock(std::uint64_t seed);

[[nodiscard]] double TopAt(const FreeformBlock& block, double x_mm, double y_mm);
[[nodiscard]] Eigen::Vector3d TopPoint(const FreeformBlock& block, double x_mm, double y_mm);
/// Outward, of length 1, from the exact derivatives.
[[nodiscard]] Eigen::Vector3d TopNormal(const FreeformBlock& block, double x_mm, double y_mm);

/// Whether the straight line from a place on the surface to an eye passes outside of the block;
/// looked at every 8 mm. Hills that hide less than that hide nothing.
[[nodiscard]] bool IsOpenTo(const FreeformBlock& block, const Eigen::Vector3d& at_mm,
                            const Eigen::Vector3d& eye_mm);

}  // namespace trammel::sim
