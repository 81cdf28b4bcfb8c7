#include "part_alignment/mesh/mesh_distance.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>

#include "base/random.h"
#include "part_alignment/mesh/mesh_test_support.h"

namespace trammel::part_alignment {
namespace {

using Eigen::Vector3d;

MeshDistance DistanceOf(TriangleMesh mesh, bool open = false) {
  auto solid = MakeSolid(std::move(mesh), open);
  EXPECT_TRUE(solid) << (solid ? "" : solid.error().message);
  return MeshDistance(std::move(*solid));
}

// Computes the distance from a box about the origin, in closed form.
double BoxDistance(const Vector3d& half_mm, const Vector3d& p) {
  const Vector3d off = p.cwiseAbs() - half_mm;
  return off.cwiseMax(0).norm() + std::min(0.0, off.maxCoeff());
}

Vector3d Drawn(Random& random, double most) {
  return {random.Uniform(-most, most), random.Uniform(-most, most), random.Uniform(-most, most)};
}

// Computes the winding number of a closed surface: 1 inside, 0 outside, by solid angles (Van
// Oosterom & Strackee 1983).
double WindingNumber(const TriangleMesh& mesh, const Vector3d& p) {
  double sum = 0;
  for (const Triangle& t : mesh.triangles) {
    const Vector3d a = mesh.vertices_mm[t[0]] - p;
    const Vector3d b = mesh.vertices_mm[t[1]] - p;
    const Vector3d c = mesh.vertices_mm[t[2]] - p;
    sum += 2 * std::atan2(a.dot(b.cross(c)), a.norm() * b.norm() * c.norm() + a.dot(b) * c.norm() +
                                                 b.dot(c) * a.norm() + c.dot(a) * b.norm());
  }
  return sum / (4 * std::numbers::pi);
}

double NearestOfAll(const TriangleMesh& mesh, const Vector3d& p) {
  double least = std::numeric_limits<double>::infinity();
  for (const Triangle& t : mesh.triangles) {
    const auto nearest = NearestPoint(p, mesh.vertices_mm[t[0]], mesh.vertices_mm[t[1]],
                                      mesh.vertices_mm[t[2]], false);
    least = std::min(least, (p - nearest.at_mm).norm());
  }
  return least;
}

TEST(MeshDistance, IsTheBoxsEverywhereEdgesAndCornersToo) {
  const Vector3d half_mm(40, 25, 15);
  const MeshDistance box = DistanceOf(test::BoxMesh(half_mm));
  Random random(101);
  for (int i = 0; i < 20'000; ++i) {
    const Vector3d p = Drawn(random, 60);
    EXPECT_NEAR(box.At(p).mm, BoxDistance(half_mm, p), 1e-12);
  }
  // Right above edges and corners, and on them.
  for (int i = 0; i < 2000; ++i) {
    Vector3d p = half_mm + Drawn(random, 1e-3);
    if (i % 2 == 0) p.x() = random.Uniform(-40, 40);
    EXPECT_NEAR(box.At(p).mm, BoxDistance(half_mm, p), 1e-12);
  }
  EXPECT_NEAR(box.At(half_mm).mm, 0, 1e-12);
}

// A star of long spikes and deep valleys: at its tips and in its valleys a face's normal alone has
// the sign wrong.
TEST(MeshDistance, HasTheSignOfTheWindingNumberAtSpikesAndValleys) {
  const TriangleMesh star = test::RoundMesh(12, [](double polar) {
    const double radius = 20 + 14 * std::cos(11 * polar);
    return std::pair{radius * std::sin(polar), radius * std::cos(polar)};
  });
  const MeshDistance distance = DistanceOf(star);
  Random random(102);
  int inside = 0;
  for (int i = 0; i < 2000; ++i) {
    const Vector3d p = Drawn(random, 40);
    const SurfaceDistance found = distance.At(p);
    const bool within = WindingNumber(star, p) > 0.5;
    inside += within ? 1 : 0;
    EXPECT_EQ(found.mm < 0, within) << p.transpose();
    EXPECT_NEAR(std::abs(found.mm), NearestOfAll(star, p), 1e-12);
    EXPECT_NEAR((p - found.nearest_mm).norm(), std::abs(found.mm), 1e-12);
  }
  EXPECT_GT(inside, 50);
}

TEST(MeshDistance, OutwardIsTheDistancesGradient) {
  const MeshDistance ball = DistanceOf(test::SphereMesh(30, 20));
  Random random(103);
  int steady = 0;
  for (int i = 0; i < 500; ++i) {
    const Vector3d p = Drawn(random, 45);
    const SurfaceDistance at = ball.At(p);
    if (at.mm < -5) continue;  // nearer to the middle the nearest place jumps
    Vector3d gradient;
    constexpr double kStep = 1e-5;
    for (int axis = 0; axis < 3; ++axis) {
      const Vector3d step = kStep * Vector3d::Unit(axis);
      gradient[axis] = (ball.At(p + step).mm - ball.At(p - step).mm) / (2 * kStep);
    }
    if ((gradient - at.outward).norm() < 1e-4) ++steady;
    EXPECT_NEAR(at.outward.norm(), 1, 1e-12);
  }
  EXPECT_GT(steady, 300) << "all but where a facet ends within the step";
}

TEST(MeshDistance, TheRimOfAnOpenShellIsTold) {
  TriangleMesh lid = test::BoxMesh({40, 40, 40});
  lid.triangles.resize(10);  // top removed
  const MeshDistance distance = DistanceOf(lid, true);
  EXPECT_TRUE(distance.open());
  EXPECT_FALSE(distance.At({45, 0, 0}).at_rim);
  EXPECT_TRUE(distance.At({45, 0, 50}).at_rim);
}

TEST(MeshDistance, ANeedleOfNoHeightTakesItsNeighboursNormal) {
  // The box's upper side with a vertex on one of its edges that only a needle has.
  TriangleMesh mesh = test::BoxMesh({40, 25, 15});
  std::erase_if(mesh.triangles, [](const Triangle& t) { return t == Triangle{4, 5, 7}; });
  mesh.vertices_mm.emplace_back(0, -25, 15);
  mesh.triangles.push_back({4, 5, 8});
  mesh.triangles.push_back({4, 8, 7});
  mesh.triangles.push_back({8, 5, 7});
  const MeshDistance distance = DistanceOf(mesh);
  EXPECT_EQ(distance.slivers(), 1U);
  Random random(105);
  for (int i = 0; i < 20'000; ++i) {
    const Vector3d p = Drawn(random, 60);
    EXPECT_NEAR(distance.At(p).mm, BoxDistance({40, 25, 15}, p), 1e-12) << p.transpose();
  }
}

}  // namespace
}  // namespace trammel::part_alignment
