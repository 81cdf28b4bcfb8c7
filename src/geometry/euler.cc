#include "geometry/euler.h"

#include <Eigen/Geometry>
#include <cmath>

#include "base/check.h"

namespace trammel::geometry {
namespace {

using Eigen::Matrix3d;
using Eigen::Vector3d;

Matrix3d AboutAxis(int axis, double angle_rad) {
  return Eigen::AngleAxisd(angle_rad, Vector3d::Unit(axis)).toRotationMatrix();
}

/// d/d(angle) of AboutAxis: the rotation by a right angle more, without the part along the axis.
Matrix3d DerivativeAboutAxis(int axis, double angle_rad) {
  const Vector3d unit = Vector3d::Unit(axis);
  const Matrix3d across = Matrix3d::Identity() - unit * unit.transpose();
  return AboutAxis(axis, angle_rad + std::acos(0.0)) * across;
}

}  // namespace

Matrix3d RotationFromAngles(const Vector3d& angles_rad) {
  return AboutAxis(2, angles_rad.z()) * AboutAxis(1, angles_rad.y()) * AboutAxis(0, angles_rad.x());
}

Vector3d AnglesFromRotation(const Matrix3d& rotation) {
  const double cos_beta = std::hypot(rotation(0, 0), rotation(1, 0));
  const double beta = std::atan2(-rotation(2, 0), cos_beta);
  constexpr double kGimbalLock = 1e-12;
  if (cos_beta < kGimbalLock) {
    return {std::atan2(-rotation(1, 2), rotation(1, 1)), beta, 0};
  }
  return {std::atan2(rotation(2, 1), rotation(2, 2)), beta,
          std::atan2(rotation(1, 0), rotation(0, 0))};
}

Matrix3d RotationDerivative(const Vector3d& angles_rad, int i) {
  TRAMMEL_CHECK(i >= 0 && i < 3, "i = {}", i);
  Matrix3d rotation = Matrix3d::Identity();
  for (int axis = 2; axis >= 0; --axis) {
    rotation *=
        axis == i ? DerivativeAboutAxis(axis, angles_rad[axis]) : AboutAxis(axis, angles_rad[axis]);
  }
  return rotation;
}

Matrix3d RotationFromVector(const Vector3d& vector_rad) {
  const double angle_rad = vector_rad.norm();
  if (angle_rad == 0) return Matrix3d::Identity();
  return Eigen::AngleAxisd(angle_rad, vector_rad / angle_rad).toRotationMatrix();
}

}  // namespace trammel::geometry
