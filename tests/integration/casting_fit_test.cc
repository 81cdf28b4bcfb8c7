// The virtual casting before the part fit: the best placement is known, the surface exactly.
#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <cmath>
#include <numbers>

#include "base/random.h"
#include "casting_world.h"
#include "geometry/euler.h"
#include "geometry/linear_systems.h"

namespace trammel {
namespace {

using Eigen::Vector3d;
using part_alignment::FitPart;
using part_alignment::PartFit;
using ::testing::AnyOf;
using ::testing::Contains;
using ::testing::HasSubstr;

const Vector3d kHalf_mm(400, 250, 150);
constexpr double kWanted_mm = 3;
constexpr double kLeast_mm = 0.5;
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

PartFit Fit(const CastingWorld& world) {
  const auto fit = FitPart(world.input, world.options);
  EXPECT_TRUE(fit) << (fit ? "" : fit.error().message);
  return fit ? *fit : PartFit{};
}

// From nothing: 10^4 points, 10^6 triangles, any rotation.
TEST(CastingFit, IsWithinWhatTheTrianglesAreOffOfTheBestAtAMillionTriangles) {
  constexpr int kMillion = 289;  // 12 · 289² triangles
  const CastingWorld world = WorldWithMesh({}, kSeed, kMillion);
  const PartFit fit = Fit(world);
  ASSERT_EQ(fit.verdict, Verdict::kGood) << fit.reason;
  const PlacementError error = ErrorOf(world, fit);
  // The guard of the points that it rests on can move all of the part.
  EXPECT_LT(error.shift_mm, 4 * fit.facet_error_mm);
  EXPECT_LT(fit.facet_error_mm, 0.01);
  EXPECT_GE(LeastExactStock_mm(world, fit), kLeast_mm - 1e-6);
  int binding = 0;
  for (const auto& at : fit.stock_allowances) {
    EXPECT_GE(at.stock_allowance_mm, at.least_mm - 1e-6);
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
    EXPECT_GE(LeastExactStock_mm(world, fit), kLeast_mm - 1e-6) << steps;
    EXPECT_THAT(fit.notices, Contains(HasSubstr("off the smooth surface")));
    // The guard, at most half as much again, can move all of the part.
    EXPECT_LT(ErrorOf(world, fit).shift_mm, 4 * fit.facet_error_mm) << steps;
  }
}

TEST(CastingFit, AToleranceThatTheTrianglesDoNotKeepLeavesTheAnswerOpen) {
  CastingWorld world = WorldWithMesh(FewPoints(), kSeed + 1, 40);
  world.input.surfaces[0].most_facet_error_mm = 0.01;
  const PartFit fit = Fit(world);
  EXPECT_EQ(fit.verdict, Verdict::kCannotTell);
  EXPECT_THAT(fit.reason, HasSubstr("too coarse"));
  EXPECT_TRUE(fit.targets.empty());
}

TEST(CastingFit, MillimetresInchesAndMetresGiveTheSamePlacement) {
  CastingWorld world = MakeCastingWorld(kHalf_mm, FewPoints(), kSeed + 2);
  const auto facets = sim::FreeformFacets(world.part, 80);
  std::vector<PartFit> fits;
  for (const char* unit : {"mm", "inch", "m", "cm"}) {
    world.input.surfaces = {MeshSurface(facets, kWanted_mm, unit)};
    fits.push_back(Fit(world));
    ASSERT_EQ(fits.back().verdict, Verdict::kGood) << unit << fits.back().reason;
  }
  constexpr double kRounding_mm = 5e-4;  // 32-bit numbers of 400 mm: 3e-5, on some points alone
  for (const PartFit& fit : fits) {
    EXPECT_LT((fit.ideal_from_measured.translation_mm - fits[0].ideal_from_measured.translation_mm)
                  .norm(),
              kRounding_mm);
  }
}

TEST(CastingFit, AnInchForAMillimetreIsNamed) {
  CastingWorld world = MakeCastingWorld(kHalf_mm, FewPoints(), kSeed + 2);
  auto facets = sim::FreeformFacets(world.part, 30);
  for (auto& facet : facets) {
    for (Vector3d& corner : facet) corner *= 25.4;
  }
  world.input.surfaces = {MeshSurface(facets, kWanted_mm)};
  const PartFit large = Fit(world);
  EXPECT_EQ(large.verdict, Verdict::kRefused);
  EXPECT_THAT(large.reason, HasSubstr("times too large, near 25.4, an inch in mm"));
  for (auto& facet : facets) {
    for (Vector3d& corner : facet) corner /= 25.4 * 25.4;
  }
  world.input.surfaces = {MeshSurface(facets, kWanted_mm)};
  const PartFit small = Fit(world);
  EXPECT_EQ(small.verdict, Verdict::kRefused);
  EXPECT_THAT(small.reason, HasSubstr("times too small, near 25.4, an inch in mm"));
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
  world.options.least_stock_allowance_mm = 1.2;
  const PartFit fit = Fit(world);
  EXPECT_EQ(fit.verdict, Verdict::kCannotTell);
  EXPECT_THAT(fit.reason, HasSubstr("finer deflection"));
}

TEST(CastingFit, AnotherPartsMeshIsNotTakenForThisOnes) {
  for (std::uint64_t seed = kSeed + 10; seed < kSeed + 14; ++seed) {
    CastingWorld world = MakeCastingWorld(kHalf_mm, FewPoints(), seed);
    const sim::Freeform other = sim::DrawFreeform(kHalf_mm, seed + 100);
    world.input.surfaces = {MeshSurface(sim::FreeformFacets(other, 40), kWanted_mm)};
    const PartFit fit = Fit(world);
    EXPECT_NE(fit.verdict, Verdict::kGood) << seed;
    EXPECT_THAT(fit.reason, AnyOf(HasSubstr("do not lie on the mesh"), HasSubstr("are missing"),
                                  HasSubstr("fit alike")))
        << seed;
  }
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
  const PartFit wrong = Fit(world);
  EXPECT_EQ(wrong.verdict, Verdict::kCannotTell);
  EXPECT_THAT(wrong.reason, HasSubstr("correct the start"));
  world.input.start = geometry::Pose{world.casting.translation_mm + Vector3d(30, -20, 25),
                                     geometry::AnglesFromRotation(world.casting.rotation)};
  EXPECT_EQ(Fit(world).verdict, Verdict::kGood) << "30 mm off is near enough";
}

// Noise on every point, targets too: their covariance is their scatter about the best placement.
TEST(CastingFit, CovarianceOfTheTargetsIsTheirScatter) {
  sim::CastingTraits traits;
  traits.points = 400;
  const CastingWorld clean = WorldWithMesh(traits, kSeed + 6, 40);
  const PartFit truth = Fit(clean);
  ASSERT_EQ(truth.verdict, Verdict::kGood) << truth.reason;
  Random random(kSeed + 6);
  constexpr int kRepeats = 20;
  double distance = 0;
  for (int repeat = 0; repeat < kRepeats; ++repeat) {
    CastingWorld world = clean;
    world.input.start = truth.ideal_from_measured;
    for (auto& point : world.input.points) {
      for (double& mm : point.at_mm) mm += random.Normal(0, point.sigma_mm);
    }
    const PartFit fit = Fit(world);
    ASSERT_EQ(fit.verdict, Verdict::kGood) << fit.reason;
    Eigen::VectorXd error(12);
    for (std::size_t i = 0; i < 4; ++i) {
      error.segment<3>(3 * static_cast<Eigen::Index>(i)) =
          fit.targets[i].ideal_mm - truth.targets[i].ideal_mm;
    }
    distance += geometry::SquaredMahalanobisDistance(truth.covariance, error) / kRepeats;
  }
  // Chi-square of 12 degrees, mean of 20: four standard deviations are 4 sqrt(24 / 20) = 4.4; below
  // by as much as the triangles' error adds to sigma.
  EXPECT_LT(distance, 12 + 4.4);
  EXPECT_GT(distance, 12 - 6);
}

}  // namespace
}  // namespace trammel
