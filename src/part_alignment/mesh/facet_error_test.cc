#include "part_alignment/mesh/facet_error.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <numbers>

#include "base/random.h"
#include "part_alignment/mesh/mesh_test_support.h"

namespace trammel::part_alignment {
namespace {

MeshDistance DistanceOf(TriangleMesh mesh) {
  return MeshDistance(*MakeSolid(std::move(mesh), false));
}

FacetError WorstOf(const MeshDistance& mesh) {
  FacetError worst;
  for (std::uint32_t t = 0; t < mesh.mesh().triangles.size(); ++t) {
    const FacetError error = FacetErrorOf(mesh, t);
    worst.outward_mm = std::max(worst.outward_mm, error.outward_mm);
    worst.inward_mm = std::max(worst.inward_mm, error.inward_mm);
  }
  return worst;
}

// What a facet's middle and its edges' middles lack to the sphere.
double TrueSagitta(const TriangleMesh& mesh, double radius_mm) {
  double most = 0;
  for (const Triangle& t : mesh.triangles) {
    const Eigen::Vector3d& a = mesh.vertices_mm[t[0]];
    const Eigen::Vector3d& b = mesh.vertices_mm[t[1]];
    const Eigen::Vector3d& c = mesh.vertices_mm[t[2]];
    for (const Eigen::Vector3d& at :
         {Eigen::Vector3d((a + b + c) / 3), Eigen::Vector3d((a + b) / 2),
          Eigen::Vector3d((b + c) / 2), Eigen::Vector3d((c + a) / 2)}) {
      most = std::max(most, radius_mm - at.norm());
    }
  }
  return most;
}

TEST(FacetError, OfASphereIsItsSagitta) {
  for (const int rings : {20, 60}) {
    const TriangleMesh mesh = test::SphereMesh(100, rings);
    const double truth = TrueSagitta(mesh, 100);
    const FacetError worst = WorstOf(DistanceOf(mesh));
    constexpr double kFactor = 1.5;  // triangles at the poles are not even
    EXPECT_GT(worst.outward_mm, truth / kFactor);
    EXPECT_LT(worst.outward_mm, truth * kFactor);
    EXPECT_EQ(worst.either_mm(), worst.outward_mm) << "a sphere is nowhere hollow";
  }
}

// With its lift a triangle is the sphere but for a small part of the sagitta.
TEST(FacetError, TheLiftOfFineTrianglesMakesThemSmooth) {
  constexpr double kRadius_mm = 100;
  const TriangleMesh sphere = test::SphereMesh(kRadius_mm, 160);
  const double sagitta = TrueSagitta(sphere, kRadius_mm);
  const MeshDistance mesh = DistanceOf(sphere);
  Random random(111);
  double square = 0;
  constexpr int kPlaces = 2000;
  for (int i = 0; i < kPlaces; ++i) {
    const Eigen::Vector3d u =
        Eigen::Vector3d(random.Normal(), random.Normal(), random.Normal()).normalized();
    const SurfaceDistance at = mesh.At((kRadius_mm + 3) * u);
    const SmoothLift lift = SmoothLiftAt(mesh, at.triangle, at.nearest_mm);
    EXPECT_GE(lift.mm, -1e-12);
    square += (at.mm - lift.mm - 3) * (at.mm - lift.mm - 3) / kPlaces;
    if (at.outward != mesh.FaceNormal(at.triangle)) continue;  // over an edge
    EXPECT_LT((at.outward - lift.gradient - u).norm(), (at.outward - u).norm() / 2 + 1e-3);
  }
  EXPECT_LT(std::sqrt(square), 0.1 * sagitta);
  EXPECT_EQ(SmoothLiftAt(DistanceOf(test::SphereMesh(kRadius_mm, 20)), 0, {0, 0, 100}).mm, 0)
      << "coarse triangles are left as they are";
}

TEST(FacetError, OfAHollowIsNoneOutwards) {
  TriangleMesh mesh = test::BoxMesh({200, 200, 200});
  TriangleMesh hollow = test::SphereMesh(100, 30);
  for (Triangle& t : hollow.triangles) std::swap(t[1], t[2]);
  const double truth = TrueSagitta(hollow, 100);
  test::Append(mesh, hollow);
  const FacetError worst = WorstOf(DistanceOf(mesh));
  EXPECT_LT(worst.outward_mm, 1e-9);
  EXPECT_GT(worst.either_mm(), truth / 1.5);
}

TEST(FacetError, OfAPlaneIsNoneAndSharpEdgesAreThePartsOwn) {
  EXPECT_EQ(WorstOf(DistanceOf(test::BoxMesh({40, 25, 15}))).either_mm(), 0);
}

// A plate with rounded ends, as CAD programs tessellate it: faces of 400 mm beside strips of 2.6.
TEST(FacetError, AFlatFaceBesideNarrowStripsHasTheErrorOfTheStrips) {
  constexpr int kStrips = 12;
  constexpr double kRadius_mm = 10;
  std::vector<Eigen::Vector2d> outline;
  for (const double side : {1.0, -1.0}) {
    for (int i = 0; i <= kStrips; ++i) {
      const double angle = std::numbers::pi * (static_cast<double>(i) / kStrips - 0.5);
      outline.emplace_back(side * (200 + kRadius_mm * std::cos(angle)),
                           side * kRadius_mm * std::sin(angle));
    }
  }
  TriangleMesh mesh;
  const auto n = static_cast<std::uint32_t>(outline.size());
  for (const double y : {-50.0, 50.0}) {
    for (const auto& at : outline) mesh.vertices_mm.emplace_back(at.x(), y, at.y());
  }
  for (std::uint32_t i = 0; i < n; ++i) {
    const std::uint32_t j = (i + 1) % n;
    mesh.triangles.push_back({i, n + j, j});
    mesh.triangles.push_back({i, n + i, n + j});
  }
  for (std::uint32_t i = 1; i + 1 < n; ++i) {
    mesh.triangles.push_back({0, i, i + 1});
    mesh.triangles.push_back({n, n + i + 1, n + i});
  }
  const double bend = std::numbers::pi / kStrips;
  const double sagitta = kRadius_mm * (1 - std::cos(bend / 2));
  const FacetError worst = WorstOf(DistanceOf(mesh));
  EXPECT_GT(worst.outward_mm, 0.9 * sagitta);
  EXPECT_LT(worst.outward_mm, 2.2 * sagitta);
}

}  // namespace
}  // namespace trammel::part_alignment
