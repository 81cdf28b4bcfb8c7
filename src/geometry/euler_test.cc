#include "geometry/euler.h"

#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <numbers>

namespace trammel::geometry {
namespace {

using Eigen::Matrix3d;
using Eigen::Vector3d;

const Vector3d kAngles_rad(0.3, -0.7, 1.9);
constexpr double kRounding = 1e-14;

TEST(Euler, TurnsAboutTheFixedAxesXThenYThenZ) {
  const double quarter = std::numbers::pi / 2;
  EXPECT_TRUE((RotationFromAngles({quarter, 0, 0}) * Vector3d::UnitY())
                  .isApprox(Vector3d::UnitZ(), kRounding));
  EXPECT_TRUE((RotationFromAngles({0, quarter, 0}) * Vector3d::UnitZ())
                  .isApprox(Vector3d::UnitX(), kRounding));
  EXPECT_TRUE((RotationFromAngles({0, 0, quarter}) * Vector3d::UnitX())
                  .isApprox(Vector3d::UnitY(), kRounding));
  // y goes to z by x, to x by y, to y by z; any other order ends elsewhere.
  EXPECT_TRUE((RotationFromAngles({quarter, quarter, quarter}) * Vector3d::UnitY())
                  .isApprox(Vector3d::UnitY(), kRounding));
}

TEST(Euler, AnglesComeBack) {
  EXPECT_TRUE(AnglesFromRotation(RotationFromAngles(kAngles_rad)).isApprox(kAngles_rad, kRounding));
  for (const double beta : {std::numbers::pi / 2, -std::numbers::pi / 2}) {
    const Matrix3d rotation = RotationFromAngles({0.4, beta, 0.9});
    EXPECT_TRUE(RotationFromAngles(AnglesFromRotation(rotation)).isApprox(rotation, 1e-12));
  }
}

TEST(Euler, AVectorTurnsAboutItself) {
  EXPECT_EQ(RotationFromVector(Vector3d::Zero()), Matrix3d::Identity());
  EXPECT_TRUE(RotationFromVector({0, 0, 0.4}).isApprox(RotationFromAngles({0, 0, 0.4}), kRounding));
  const Vector3d vector_rad(0.3, -0.2, 0.6);
  EXPECT_TRUE((RotationFromVector(vector_rad) * vector_rad).isApprox(vector_rad, kRounding));
}

TEST(Euler, DerivativesAreThoseOfFiniteDifferences) {
  constexpr double kStep_rad = 1e-6;
  constexpr double kError = 1e-9;  // rounding / step, and step squared
  for (int i = 0; i < 3; ++i) {
    const Vector3d step = kStep_rad * Vector3d::Unit(i);
    const Matrix3d numeric =
        (RotationFromAngles(kAngles_rad + step) - RotationFromAngles(kAngles_rad - step)) /
        (2 * kStep_rad);
    EXPECT_LT((RotationDerivative(kAngles_rad, i) - numeric).cwiseAbs().maxCoeff(), kError);
  }
}

}  // namespace
}  // namespace trammel::geometry
