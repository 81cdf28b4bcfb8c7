// Fits against triangles: of blocks, which planes describe as well, and of parts that turn.
#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <memory>
#include <numbers>

#include "base/random.h"
#include "part_alignment/mesh/mesh_test_support.h"
#include "part_alignment/part_fit/part_fit.h"
#include "support/matchers.h"

namespace trammel::part_alignment {
namespace {

using Eigen::Vector3d;
using ::testing::HasSubstr;

constexpr double kSigma_mm = 0.05;
constexpr double kWanted_mm = 3;
const Vector3d kHalf_mm(400, 250, 150);
const geometry::Pose kIdealFromMeasured{{812.3, -455.1, 96.4}, {0.31, -0.22, 1.7}};

Vector3d InMeasurement(const Vector3d& ideal_mm) {
  return geometry::RotationFromAngles(kIdealFromMeasured.angles_rad).transpose() *
         (ideal_mm - kIdealFromMeasured.translation_mm);
}

IdealSurface Mesh(TriangleMesh mesh, bool open = false) {
  auto solid = MakeSolid(std::move(mesh), open);
  EXPECT_TRUE(solid) << (solid ? "" : solid.error().message);
  IdealSurface surface;
  surface.id = "cad";
  surface.kind = SurfaceKind::kMesh;
  surface.stock_allowance_mm = kWanted_mm;
  surface.mesh = std::make_shared<MeshDistance>(std::move(*solid));
  return surface;
}

// Points all over a block's faces, each 1.5 to 4.5 mm proud, their face in `surface`.
PartFitInput Block(std::uint64_t seed, int per_face = 25) {
  Random random(seed);
  PartFitInput input;
  for (int axis = 0; axis < 3; ++axis) {
    for (const int side : {-1, 1}) {
      for (int i = 0; i < per_face; ++i) {
        Vector3d at;
        at[axis] = side * (kHalf_mm[axis] + random.Uniform(1.5, 4.5));
        for (const int other : {(axis + 1) % 3, (axis + 2) % 3}) {
          at[other] = random.Uniform(-0.95, 0.95) * kHalf_mm[other];
        }
        input.points.push_back({fmt::format("p{}", input.points.size()), InMeasurement(at),
                                kSigma_mm, fmt::format("{}{}", side > 0 ? '+' : '-', axis)});
      }
    }
  }
  for (const Vector3d& at : {Vector3d(-350, -200, 160), Vector3d(350, -200, 160),
                             Vector3d(350, 200, 160), Vector3d(-350, 200, 160)}) {
    input.points.push_back(
        {fmt::format("T{}", input.points.size()), InMeasurement(at), kSigma_mm, ""});
  }
  return input;
}

void UseMesh(PartFitInput& input, IdealSurface surface) {
  for (MeasuredPoint& point : input.points) {
    if (!point.surface.empty()) point.surface = surface.id;
  }
  input.surfaces = {std::move(surface)};
}

void UsePlanes(PartFitInput& input) {
  for (int axis = 0; axis < 3; ++axis) {
    for (const int side : {-1, 1}) {
      const Vector3d normal = side * Vector3d::Unit(axis);
      input.surfaces.push_back({fmt::format("{}{}", side > 0 ? '+' : '-', axis),
                                SurfaceKind::kPlane, kHalf_mm[axis] * normal, normal, 0,
                                kWanted_mm});
    }
  }
}

TEST(MeshFit, ABlockOfTrianglesIsTheBlockOfItsPlanes) {
  for (const std::uint64_t seed : {201U, 202U, 203U}) {
    PartFitInput planes = Block(seed);
    PartFitInput mesh = planes;
    UsePlanes(planes);
    UseMesh(mesh, Mesh(test::BoxMesh(kHalf_mm)));
    mesh.start = kIdealFromMeasured;
    PartFitOptions options;
    options.min_stock_allowance_mm = 1.45;  // with its guard: active at some points
    const auto by_planes = FitPart(planes, options);
    const auto by_mesh = FitPart(mesh, options);
    ASSERT_TRUE(by_planes && by_mesh);
    ASSERT_EQ(by_planes->verdict, Verdict::kGood) << by_planes->reason;
    ASSERT_EQ(by_mesh->verdict, Verdict::kGood) << by_mesh->reason;
    for (std::size_t i = 0; i < 4; ++i) {
      EXPECT_LT((by_planes->targets[i].ideal_mm - by_mesh->targets[i].ideal_mm).norm(), 1e-6);
    }
    EXPECT_LT((by_planes->covariance - by_mesh->covariance).cwiseAbs().maxCoeff(), 1e-9);
    EXPECT_NEAR(by_planes->min_mm, by_mesh->min_mm, 1e-6);
    EXPECT_EQ(by_mesh->facet_error_mm, 0);
  }
}

TEST(MeshFit, ABlockFromNowhereFitsInFourWaysWhichAreNamed) {
  PartFitInput input = Block(204);
  UseMesh(input, Mesh(test::BoxMesh(kHalf_mm)));
  const auto fit = Must(FitPart(input, {}));
  EXPECT_THAT(fit, Answers(Verdict::kCannotTell, "two placements fit alike", "180.0°", "start"));
  EXPECT_TRUE(fit.targets.empty());
}

// Points about a body of revolution, proud of it by what is wanted.
PartFitInput Turned(const TriangleMesh& mesh, double radius_mm, double half_mm) {
  PartFitInput input;
  Random random(207);
  for (int i = 0; i < 300; ++i) {
    const double angle = random.Uniform(0, 2 * std::numbers::pi);
    Vector3d at(std::cos(angle), std::sin(angle), 0);
    if (i % 3 == 0) {
      at *= random.Uniform(0, radius_mm);
      at.z() = (i % 2 == 0 ? 1 : -1) * (half_mm + kWanted_mm);
    } else {
      at *= radius_mm + kWanted_mm;
      at.z() = random.Uniform(-half_mm, half_mm);
    }
    input.points.push_back({fmt::format("p{}", i), InMeasurement(at), kSigma_mm, "cad"});
  }
  UseMesh(input, Mesh(mesh));
  return input;
}

TriangleMesh Cylinder(double radius_mm, double half_mm, int sides) {
  TriangleMesh mesh;
  for (const double z : {-half_mm, half_mm}) {
    for (int i = 0; i < sides; ++i) {
      const double angle = 2 * std::numbers::pi * i / sides;
      mesh.vertices_mm.emplace_back(radius_mm * std::cos(angle), radius_mm * std::sin(angle), z);
    }
  }
  const auto n = static_cast<std::uint32_t>(sides);
  for (std::uint32_t i = 0; i < n; ++i) {
    const std::uint32_t j = (i + 1) % n;
    mesh.triangles.push_back({i, j, n + j});
    mesh.triangles.push_back({i, n + j, n + i});
  }
  for (std::uint32_t i = 1; i + 1 < n; ++i) {
    mesh.triangles.push_back({0, i + 1, i});
    mesh.triangles.push_back({n, n + i, n + i + 1});
  }
  return mesh;
}

TEST(MeshFit, ATurnedPartIsFreeToTurnHoweverCoarseItsFacets) {
  for (const int sides : {16, 36, 100, 720}) {
    PartFitInput input = Turned(Cylinder(80, 120, sides), 80, 120);
    EXPECT_THAT(FitPart(input, {}),
                Answers(Verdict::kCannotTell, "leave the part free", "a turn about z"))
        << sides;
  }
}

TEST(MeshFit, PointsBeyondTheRimOfAnOpenShellAreNamed) {
  TriangleMesh lid = test::BoxMesh(kHalf_mm);
  std::erase_if(lid.triangles, [](const Triangle& t) { return t[0] == 4 && t[1] != 0; });
  PartFitInput input = Block(208);
  UseMesh(input, Mesh(lid, true));
  input.start = kIdealFromMeasured;
  const auto fit = Must(FitPart(input, {}));
  EXPECT_NE(fit.verdict, Verdict::kGood);
  std::erase_if(input.points, [](const MeasuredPoint& point) {
    const Vector3d at = geometry::RotationFromAngles(kIdealFromMeasured.angles_rad) * point.at_mm +
                        kIdealFromMeasured.translation_mm;
    return !point.surface.empty() && at.z() > 100;
  });
  EXPECT_THAT(FitPart(input, {}), Answers(Verdict::kGood));
}

TEST(MeshFit, WhatCannotBeIsNamed) {
  PartFitInput input = Block(209);
  UseMesh(input, Mesh(test::BoxMesh(kHalf_mm)));
  PartFitOptions options;
  options.max_uneven_mm = 0;
  EXPECT_THAT(FitPart(input, options).error().message, HasSubstr("most_uneven_mm"));
  input.surfaces[0].mesh = nullptr;
  EXPECT_THAT(FitPart(input, {}).error().message, HasSubstr("has no mesh"));
}

}  // namespace
}  // namespace trammel::part_alignment
