#include "part_alignment/mesh/solid_mesh.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <limits>

#include "part_alignment/mesh/mesh_test_support.h"
#include "part_alignment/mesh/triangle_mesh.h"
#include "support/matchers.h"

namespace trammel::part_alignment {
namespace {

using Eigen::Vector3d;
using ::testing::HasSubstr;
using ::testing::IsEmpty;

const Vector3d kHalf_mm(40, 25, 15);

std::string Complaint(TriangleMesh mesh, bool open = false) {
  return ErrorOf(MakeSolid(std::move(mesh), open));
}

double Volume(const SolidMesh& solid) {
  double volume = 0;
  for (const Triangle& t : solid.mesh.triangles) {
    volume += AreaVector(solid.mesh, t).dot(solid.mesh.vertices_mm[t[0]]) / 6;
  }
  return volume;
}

TEST(SolidMesh, ASoundBoxIsLeftAlone) {
  const auto solid = Must(MakeSolid(test::BoxMesh(kHalf_mm), false));
  EXPECT_THAT(solid.notices, IsEmpty());
  EXPECT_FALSE(solid.open);
  EXPECT_NEAR(Volume(solid), 80 * 50 * 30, 1e-9);
}

TEST(SolidMesh, AnOpenShellIsNamedWithItsPlace) {
  TriangleMesh mesh = test::BoxMesh(kHalf_mm);
  mesh.triangles.pop_back();
  EXPECT_THAT(Complaint(mesh), Containing("open: 3 edges", "15.000) mm"));
  const auto open = Must(MakeSolid(mesh, true));
  EXPECT_TRUE(open.open);
}

TEST(SolidMesh, TwoSolidsAreNamedWithTheirSizes) {
  TriangleMesh mesh = test::BoxMesh(kHalf_mm);
  test::Append(mesh, test::BoxMesh({1, 2, 3}, {100, 0, 0}));
  EXPECT_THAT(Complaint(mesh),
              Containing("2 closed bodies", "80.000 × 50.000", "2.000 × 4.000 × 6.000"));
  TriangleMesh inner = test::BoxMesh(kHalf_mm);
  test::Append(inner, test::BoxMesh({1, 2, 3}));
  EXPECT_THAT(Complaint(inner), HasSubstr("2 closed bodies")) << "one in the other is no cavity";
}

TEST(SolidMesh, ACavityIsPartOfItsSolid) {
  TriangleMesh mesh = test::BoxMesh(kHalf_mm);
  TriangleMesh cavity = test::BoxMesh({1, 2, 3});
  for (Triangle& t : cavity.triangles) std::swap(t[1], t[2]);
  test::Append(mesh, cavity);
  const auto solid = Must(MakeSolid(mesh, false));
  EXPECT_THAT(solid.notices[0], HasSubstr("1 inner cavities"));
  EXPECT_NEAR(Volume(solid), 80 * 50 * 30 - 48, 1e-9);
}

TEST(SolidMesh, TurnedTrianglesAreTurnedBackAndCounted) {
  TriangleMesh mesh = test::BoxMesh(kHalf_mm);
  for (const std::size_t t : {2U, 7U, 11U}) std::swap(mesh.triangles[t][0], mesh.triangles[t][1]);
  const auto solid = Must(MakeSolid(mesh, false));
  EXPECT_THAT(solid.notices[0], HasSubstr("3 of 12 triangles"));
  EXPECT_NEAR(Volume(solid), 80 * 50 * 30, 1e-9);
  for (std::uint32_t t = 0; t < 12; ++t) {
    for (int k = 0; k < 3; ++k) {
      const std::uint32_t other = solid.neighbours[t][static_cast<std::size_t>(k)];
      ASSERT_NE(other, kNoTriangle);
      EXPECT_FALSE(SameDirection(solid.mesh.triangles[t], k, solid.mesh.triangles[other]));
    }
  }
}

TEST(SolidMesh, AnInsideOutSolidIsTurned) {
  TriangleMesh mesh = test::BoxMesh(kHalf_mm);
  for (Triangle& t : mesh.triangles) std::swap(t[0], t[1]);
  const auto solid = Must(MakeSolid(mesh, false));
  EXPECT_THAT(solid.notices[0], HasSubstr("faced inwards"));
  EXPECT_NEAR(Volume(solid), 80 * 50 * 30, 1e-9);
}

TEST(SolidMesh, BodiesThatTouchAtAnEdgeAreNamed) {
  TriangleMesh mesh = test::BoxMesh({10, 10, 10});
  test::Append(mesh, test::BoxMesh({10, 10, 10}, {20, 20, 0}));
  VertexWeld weld;
  for (Triangle& t : mesh.triangles) {
    for (std::uint32_t& v : t) v = weld.Number(mesh.vertices_mm[v]);
  }
  mesh.vertices_mm = weld.Take();
  EXPECT_EQ(mesh.vertices_mm.size(), 14U);
  EXPECT_THAT(Complaint(mesh),
              Containing("1 edges have more than two triangles", "(10.000, 10.000, 0.000)"));
}

TEST(SolidMesh, TrianglesOfTwoEqualCornersAreLeftOut) {
  TriangleMesh mesh = test::BoxMesh(kHalf_mm);
  mesh.triangles.push_back({3, 3, 7});
  const auto solid = Must(MakeSolid(mesh, false));
  EXPECT_EQ(solid.mesh.triangles.size(), 12U);
  EXPECT_THAT(solid.notices[0], HasSubstr("1 triangles of no area"));
  EXPECT_THAT(Complaint({{{0, 0, 0}}, {{0, 0, 0}}}), HasSubstr("no area"));
}

TEST(SolidMesh, ACrackOfRoundingIsClosed) {
  TriangleMesh mesh = test::BoxMesh(kHalf_mm);
  mesh.vertices_mm.push_back(mesh.vertices_mm[7] + Vector3d(3e-6, -3e-6, 2e-6));
  for (std::uint32_t& v : mesh.triangles[3]) {
    if (v == 7) v = 8;
  }
  const auto solid = Must(MakeSolid(mesh, false));
  EXPECT_THAT(solid.notices[0], HasSubstr("open edges were closed"));
  mesh.vertices_mm[8] += Vector3d(0.01, 0, 0);
  EXPECT_THAT(Complaint(mesh), HasSubstr("open"));
}

// Möbius' strip of eight quadrilaterals.
TEST(SolidMesh, ASurfaceOfOneSideIsNamed) {
  TriangleMesh mesh;
  constexpr int kSteps = 8;
  for (int i = 0; i < kSteps; ++i) {
    const double turn = 2 * std::numbers::pi * i / kSteps;
    for (const double aside : {-3.0, 3.0}) {
      const double radius = 10 + aside * std::cos(turn / 2);
      mesh.vertices_mm.emplace_back(radius * std::cos(turn), radius * std::sin(turn),
                                    aside * std::sin(turn / 2));
    }
  }
  for (std::uint32_t i = 0; i < kSteps; ++i) {
    const bool last = i + 1 == kSteps;
    const std::uint32_t a = 2 * i;
    const std::uint32_t b = last ? 1 : a + 2;
    const std::uint32_t c = last ? 0 : a + 3;
    mesh.triangles.push_back({a, b, c});
    mesh.triangles.push_back({a, c, a + 1});
  }
  EXPECT_THAT(Complaint(mesh, true), HasSubstr("one side only"));
}

TEST(SolidMesh, NumbersThatCannotBeAreNamed) {
  TriangleMesh mesh = test::BoxMesh(kHalf_mm);
  mesh.vertices_mm[3].y() = std::numeric_limits<double>::quiet_NaN();
  EXPECT_THAT(Complaint(mesh), HasSubstr("triangle 3 has a corner at"));
  mesh.vertices_mm[3].y() = 2e6;
  EXPECT_THAT(Complaint(mesh), HasSubstr("within 1000000 mm"));
  EXPECT_THAT(Complaint({}), HasSubstr("no triangles"));
}

}  // namespace
}  // namespace trammel::part_alignment
