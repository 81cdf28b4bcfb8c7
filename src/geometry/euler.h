// Rotations by the angles that alignments report.
#pragma once

#include <Eigen/Core>

namespace trammel::geometry {

/// Returns R = Rz(gamma) · Ry(beta) · Rx(alpha), right-handed: rotates a vector about the fixed
/// axes x, y, z in this order. angles_rad = (alpha, beta, gamma).
[[nodiscard]] Eigen::Matrix3d RotationFromAngles(const Eigen::Vector3d& angles_rad);

/// Computes the inverse, beta in [-pi/2, pi/2]. For beta = ±pi/2 gamma is 0 (only alpha and gamma
/// combined are defined).
/// REQUIRES a rotation matrix.
[[nodiscard]] Eigen::Vector3d AnglesFromRotation(const Eigen::Matrix3d& rotation);

/// Returns dR/d(angle `i`) of RotationFromAngles, i = 0 (alpha), 1 (beta), 2 (gamma).
[[nodiscard]] Eigen::Matrix3d RotationDerivative(const Eigen::Vector3d& angles_rad, int i);

/// Returns the rotation by |vector_rad| about the vector, counter-clockwise seen from its tip.
[[nodiscard]] Eigen::Matrix3d RotationFromVector(const Eigen::Vector3d& vector_rad);

/// x_outer = RotationFromAngles(angles_rad) · x_inner + translation_mm.
struct Pose {
  Eigen::Vector3d translation_mm = Eigen::Vector3d::Zero();
  Eigen::Vector3d angles_rad = Eigen::Vector3d::Zero();
};

}  // namespace trammel::geometry
