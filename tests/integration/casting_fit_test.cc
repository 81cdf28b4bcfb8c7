// The virtual casting before the part fit: the best placement is known, the surface exactly.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <numbers>

#include "casting_world.h"
#include "geometry/euler.h"
#include "support/matchers.h"

namespace trammel {
namespace {

using Eigen::Vector3d;
using part_alignment::FitPart;
using part_alignment::PartFit;
using ::testing::Contains;
using ::testing::HasSubstr;

const Vector3d kHalf_mm(400, 250, 150);
constexpr double kWanted_mm = 3;
constexpr double kMin_mm = 0.5;
constexpr std::uint64_t kSeed = 1401;

sim::CastingTraits FewPoints() {
  sim::CastingTraits traits;
  traits.points = 1000;
  return traits;
}

CastingWorld WorldWithMesh(const sim::CastingTraits& traits, std::uint64_t seed, int steps) {
  CastingWorld world = MakeCastingWorld(kHalf_mm, traits, seed);
  world.input.surfaces = {MeshSurface(sim::FreeformFacets(world.part, steps), kWanted_mm)};
  return world;
}

PartFit Fit(const CastingWorld& world) { return Must(FitPart(world.input, world.options)); }

// Given no start values: 10^4 points, 10^6 triangles, any rotation.
TEST(CastingFit, IsWithinWhatTheTrianglesAreOffOfTheBestAtAMillionTriangles) {
  constexpr int kMillion = 289;  // 12 · 289² triangles
  const CastingWorld world = WorldWithMesh({}, kSeed, kMillion);
  const PartFit fit = Fit(world);
  ASSERT_EQ(fit.verdict, Verdict::kGood) << fit.reason;
  const PlacementError error = ErrorOf(world, fit);
  // The guard of the points that it rests on can move all of the part.
  EXPECT_LT(error.shift_mm, 4 * fit.facet_error_mm);
  EXPECT_LT(fit.facet_error_mm, 0.01);
  EXPECT_GE(LeastExactStock_mm(world, fit), kMin_mm - 1e-6);
  int binding = 0;
  for (const auto& at : fit.stock_allowances) {
    EXPECT_GE(at.stock_allowance_mm, at.min_mm - 1e-6);
    if (!at.binding) continue;
    ++binding;
    EXPECT_TRUE(world.casting.dent[at.point]) << "the placement rests on the dents alone";
  }
  EXPECT_EQ(binding, 3);
}

TEST(CastingFit, ACoarseMeshIsSaidToBeCoarseAndLeavesTheLeastAllTheSame) {
  for (const int steps : {20, 40, 80}) {
    const CastingWorld world = WorldWithMesh(FewPoints(), kSeed + 1, steps);
    const PartFit fit = Fit(world);
    ASSERT_EQ(fit.verdict, Verdict::kGood) << fit.reason;
    EXPECT_GE(LeastExactStock_mm(world, fit), kMin_mm - 1e-6) << steps;
    EXPECT_THAT(fit.notices, Contains(HasSubstr("off the smooth surface")));
    // The guard, at most half as much again, can move all of the part.
    EXPECT_LT(ErrorOf(world, fit).shift_mm, 4 * fit.facet_error_mm) << steps;
  }
}

TEST(CastingFit, AToleranceThatTheTrianglesDoNotKeepLeavesTheAnswerOpen) {
  CastingWorld world = WorldWithMesh(FewPoints(), kSeed + 1, 40);
  world.input.surfaces[0].max_facet_error_mm = 0.01;
  const PartFit fit = Fit(world);
  EXPECT_THAT(fit, Answers(Verdict::kCannotTell, "too coarse"));
  EXPECT_TRUE(fit.targets.empty());
}

TEST(CastingFit, WhereNoPlacementExistsItSaysHowMuchIsMissingAtBest) {
  sim::CastingTraits traits = FewPoints();
  traits.missing_mm = 1.25;
  const CastingWorld world = WorldWithMesh(traits, kSeed + 3, 120);
  const PartFit fit = Fit(world);
  EXPECT_EQ(fit.verdict, Verdict::kRefused);
  // The same everywhere: any motion takes more from some side. Triangles make it seem up to their
  // error less, their guard up to half as much again more.
  const auto at = fit.reason.find("at best ");
  ASSERT_NE(at, std::string::npos) << fit.reason;
  EXPECT_NEAR(std::stod(fit.reason.substr(at + 8)), 1.25, 0.05);
  EXPECT_GE(std::stod(fit.reason.substr(at + 8)), 1.249);
  EXPECT_TRUE(fit.targets.empty());
}

TEST(CastingFit, WhereCoarseTrianglesAskForWhatIsMissingItIsLeftOpen) {
  CastingWorld world = WorldWithMesh(FewPoints(), kSeed + 3, 16);
  world.options.min_stock_allowance_mm = 1.2;
  EXPECT_THAT(Fit(world), Answers(Verdict::kCannotTell, "finer deflection"));
}

TEST(CastingFit, OneSideOfAPartIsFoundWhereItLies) {
  sim::CastingTraits traits = FewPoints();
  traits.seen_from_z = -0.2;
  const CastingWorld world = WorldWithMesh(traits, kSeed + 4, 80);
  const PartFit fit = Fit(world);
  ASSERT_EQ(fit.verdict, Verdict::kGood) << fit.reason;
  EXPECT_LT(ErrorOf(world, fit).shift_mm, 4 * fit.facet_error_mm);
}

TEST(CastingFit, AStartThatEndsElsewhereIsNotBelieved) {
  CastingWorld world = WorldWithMesh(FewPoints(), kSeed + 5, 60);
  const Eigen::Matrix3d turned =
      geometry::RotationFromAngles({std::numbers::pi, 0, 0}) * world.casting.rotation;
  world.input.start =
      geometry::Pose{world.casting.translation_mm, geometry::AnglesFromRotation(turned)};
  EXPECT_THAT(Fit(world), Answers(Verdict::kCannotTell, "correct the start"));
  world.input.start = geometry::Pose{world.casting.translation_mm + Vector3d(30, -20, 25),
                                     geometry::AnglesFromRotation(world.casting.rotation)};
  EXPECT_EQ(Fit(world).verdict, Verdict::kGood) << "30 mm off is near enough";
}

}  // namespace
}  // namespace trammel
