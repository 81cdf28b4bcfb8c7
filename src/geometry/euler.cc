#include "geometry/euler.h"

#include <Eigen/Geometry>
#include <cmath>

#include "base/check.h"

namespace trammel::geometry {
namespace {

using Eigen::Matrix3d;
using Eigen::Vector3d;

/// Sines and cosines of alpha, beta and gamma.
struct Angles {
  explicit Angles(const Vector3d& rad)
      : sa(std::sin(rad.x())),
        ca(std::cos(rad.x())),
        sb(std::sin(rad.y())),
        cb(std::cos(rad.y())),
        sg(std::sin(rad.z())),
        cg(std::cos(rad.z())) {}
  double sa, ca, sb, cb, sg, cg;
};

}  // namespace

Matrix3d RotationFromAngles(const Vector3d& angles_rad) {
  const auto [sa, ca, sb, cb, sg, cg] = Angles(angles_rad);
  return Matrix3d{{cg * cb, cg * sb * sa - sg * ca, cg * sb * ca + sg * sa},
                  {sg * cb, sg * sb * sa + cg * ca, sg * sb * ca - cg * sa},
                  {-sb, cb * sa, cb * ca}};
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
  const auto [sa, ca, sb, cb, sg, cg] = Angles(angles_rad);
  if (i == 0) {
    return Matrix3d{{0, cg * sb * ca + sg * sa, -cg * sb * sa + sg * ca},
                    {0, sg * sb * ca - cg * sa, -sg * sb * sa - cg * ca},
                    {0, cb * ca, -cb * sa}};
  }
  if (i == 1) {
    return Matrix3d{{-cg * sb, cg * cb * sa, cg * cb * ca},
                    {-sg * sb, sg * cb * sa, sg * cb * ca},
                    {-cb, -sb * sa, -sb * ca}};
  }
  return Matrix3d{{-sg * cb, -sg * sb * sa - cg * ca, -sg * sb * ca + cg * sa},
                  {cg * cb, cg * sb * sa - sg * ca, cg * sb * ca + sg * sa},
                  {0, 0, 0}};
}

Matrix3d RotationFromVector(const Vector3d& vector_rad) {
  const double angle_rad = vector_rad.norm();
  if (angle_rad == 0) return Matrix3d::Identity();
  return Eigen::AngleAxisd(angle_rad, vector_rad / angle_rad).toRotationMatrix();
}

}  // namespace trammel::geometry
