#include "sim/casting/casting.h"

#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <algorithm>

#include "base/random.h"

namespace trammel::sim {
namespace {

using Eigen::Vector3d;

constexpr std::uint64_t kSeed = 41;
const Vector3d kHalf_mm(400, 250, 150);

TEST(Freeform, NormalsAreThoseOfDifferences) {
  const Freeform part = DrawFreeform(kHalf_mm, kSeed);
  Random random(kSeed);
  for (int i = 0; i < 200; ++i) {
    const Vector3d u = Vector3d(random.Normal(), random.Normal(), random.Normal()).normalized();
    const Vector3d normal = SurfaceNormal(part, u);
    EXPECT_GT(normal.dot(u), 0) << "outwards";
    for (const Vector3d& e :
         {Vector3d(u.unitOrthogonal()), Vector3d(u.cross(u.unitOrthogonal()))}) {
      constexpr double kStep = 1e-5;
      const Vector3d along = SurfacePoint(part, (u + kStep * e).normalized()) -
                             SurfacePoint(part, (u - kStep * e).normalized());
      EXPECT_NEAR(along.normalized().dot(normal), 0, 1e-8);
    }
  }
}

TEST(Freeform, StockAlongANormalIsItsLength) {
  const Freeform part = DrawFreeform(kHalf_mm, kSeed);
  Random random(kSeed);
  for (int i = 0; i < 500; ++i) {
    const Vector3d u = Vector3d(random.Normal(), random.Normal(), random.Normal()).normalized();
    const double stock = random.Uniform(-2, 8);
    const Vector3d at = SurfacePoint(part, u) + stock * SurfaceNormal(part, u);
    EXPECT_NEAR(StockAt(part, at), stock, 1e-8);
  }
}

TEST(Casting, NoSmallMotionIsBothMoreEvenAndLeavesTheLeast) {
  const Freeform part = DrawFreeform(kHalf_mm, kSeed);
  CastingTraits traits;
  traits.points = 600;
  const Casting casting = DrawCasting(part, traits, kSeed);
  const auto dents = std::count(casting.dent.begin(), casting.dent.end(), true);
  EXPECT_EQ(dents, traits.dents);
  const auto judge = [&](const Eigen::Matrix3d& turn, const Vector3d& shift, double& least) {
    double sum = 0;
    least = 1e9;
    for (const Vector3d& at : casting.ideal_mm) {
      const Vector3d moved = turn * at + shift;
      const double stock = StockAt(part, moved);
      least = std::min(least, stock);
      sum += (stock - traits.wanted_mm) * (stock - traits.wanted_mm);
    }
    return sum;
  };
  double least = 0;
  const double best = judge(Eigen::Matrix3d::Identity(), Vector3d::Zero(), least);
  EXPECT_NEAR(least, traits.min_mm, 1e-6);
  Random random(kSeed + 1);
  int allowed = 0;
  for (int trial = 0; trial < 60; ++trial) {
    const Vector3d axis = Vector3d(random.Normal(), random.Normal(), random.Normal()).normalized();
    const double angle = random.Normal(0, 2e-4);
    const Eigen::Matrix3d turn = Eigen::AngleAxisd(angle, axis).toRotationMatrix();
    const double sum = judge(
        turn, {random.Normal(0, 0.05), random.Normal(0, 0.05), random.Normal(0, 0.05)}, least);
    if (least < traits.min_mm) continue;
    ++allowed;
    EXPECT_GT(sum, best);
  }
  EXPECT_GT(allowed, 2);
}

}  // namespace
}  // namespace trammel::sim
