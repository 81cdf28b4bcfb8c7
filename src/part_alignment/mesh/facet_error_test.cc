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

// Returns the largest sagitta of the facets' and edges' middles below the sphere.
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
  const double bend = std::numbers::pi / kStrips;
  const double sagitta = kRadius_mm * (1 - std::cos(bend / 2));
  const FacetError worst = WorstOf(DistanceOf(test::PrismMesh(outline, 50)));
  EXPECT_GT(worst.outward_mm, 0.9 * sagitta);
  EXPECT_LT(worst.outward_mm, 2.2 * sagitta);
}

// The lifts of a mesh whose vertices lie on a surface: `above` is how far a place is from it.
template <class Above>
TriangleMesh WithLifts(TriangleMesh mesh, const Above& above) {
  for (const Triangle& t : mesh.triangles) {
    TriangleLift lift;
    for (std::size_t k = 0; k < 3; ++k) {
      lift.middle_mm[k] = static_cast<float>(
          above((mesh.vertices_mm[t[k]] + mesh.vertices_mm[t[(k + 1) % 3]]) / 2));
    }
    mesh.lifts.push_back(lift);
  }
  return mesh;
}

TEST(FacetError, KnownLiftsLeadFromCoarseTrianglesToTheSphere) {
  constexpr double kRadius_mm = 100;
  const TriangleMesh sphere =
      WithLifts(test::SphereMesh(kRadius_mm, 40),
                [&](const Eigen::Vector3d& at) { return kRadius_mm - at.norm(); });
  TriangleMesh inside_out = sphere;  // whose lifts are to the other side
  for (Triangle& t : inside_out.triangles) std::swap(t[1], t[2]);
  for (TriangleLift& lift : inside_out.lifts) {
    std::swap(lift.middle_mm[0], lift.middle_mm[2]);
    for (float& mm : lift.middle_mm) mm = -mm;
  }
  const double sagitta_mm = TrueSagitta(sphere, kRadius_mm);
  for (const TriangleMesh& mesh : {sphere, inside_out}) {
    const MeshDistance distance = DistanceOf(mesh);
    Random random(112);
    for (int i = 0; i < 1000; ++i) {
      const Eigen::Vector3d u =
          Eigen::Vector3d(random.Normal(), random.Normal(), random.Normal()).normalized();
      const double proud_mm = random.Uniform(-5, 5);
      const Eigen::Vector3d p_mm = (kRadius_mm + proud_mm) * u;
      const SmoothDistance smooth = SmoothDistanceAt(distance, distance.At(p_mm), p_mm);
      // The quadratic surface misses a sphere by the fourth power of the bend, and the poles'
      // narrow triangles by more.
      constexpr double kOfSagitta = 0.02;
      EXPECT_NEAR(smooth.mm, proud_mm, kOfSagitta * sagitta_mm);
      constexpr double kNormal_rad = 2e-3;
      EXPECT_LT((smooth.outward - u).norm(), kNormal_rad);
    }
  }
}

TEST(FacetError, KnownLiftsMoveASharpEdgeWithBothOfItsFaces) {
  constexpr double kRadius_mm = 50;
  constexpr double kHeight_mm = 40;
  constexpr int kSectors = 36;
  TriangleMesh mesh;
  const auto vertex = [](double turn, double z) {
    return Eigen::Vector3d(kRadius_mm * std::cos(turn), kRadius_mm * std::sin(turn), z);
  };
  for (int i = 0; i < kSectors; ++i) {
    const double turn = 2 * std::numbers::pi * i / kSectors;
    mesh.vertices_mm.push_back(vertex(turn, 0));
    mesh.vertices_mm.push_back(vertex(turn, kHeight_mm));
  }
  mesh.vertices_mm.emplace_back(0, 0, 0);
  mesh.vertices_mm.emplace_back(0, 0, kHeight_mm);
  for (std::uint32_t i = 0; i < kSectors; ++i) {
    const std::uint32_t a = 2 * i;
    const std::uint32_t b = 2 * ((i + 1) % kSectors);
    for (const Triangle& t :
         {Triangle{a, b, b + 1}, Triangle{a, b + 1, a + 1}, Triangle{2 * kSectors, b, a},
          Triangle{2 * kSectors + 1, a + 1, b + 1}})
      mesh.triangles.push_back(t);
  }
  mesh = WithLifts(std::move(mesh), [&](const Eigen::Vector3d& at) {
    return kRadius_mm - std::hypot(at.x(), at.y());
  });
  for (std::size_t t = 0; t < mesh.triangles.size(); ++t) {
    if (t % 4 >= 2) mesh.lifts[t] = {};  // the flat ends
  }
  const MeshDistance distance = DistanceOf(mesh);
  Random random(113);
  double plain_mm = 0;
  for (int i = 0; i < 500; ++i) {
    const double turn = random.Uniform(0, 2 * std::numbers::pi);
    const double out_mm = random.Uniform(0.5, 3);
    const double up_mm = random.Uniform(0.5, 3);
    const Eigen::Vector3d p_mm = vertex(turn, kHeight_mm + up_mm) * 1.0 +
                                 out_mm * Eigen::Vector3d(std::cos(turn), std::sin(turn), 0);
    const SurfaceDistance at = distance.At(p_mm);
    const double truth_mm = std::hypot(out_mm, up_mm);
    plain_mm = std::max(plain_mm, std::abs(at.mm - truth_mm));
    constexpr double kOfSagitta = 0.1;
    const double sagitta_mm = kRadius_mm * (1 - std::cos(std::numbers::pi / kSectors));
    EXPECT_NEAR(SmoothDistanceAt(distance, at, p_mm).mm, truth_mm, kOfSagitta * sagitta_mm);
  }
  EXPECT_GT(plain_mm, 0.1);
}

}  // namespace
}  // namespace trammel::part_alignment
