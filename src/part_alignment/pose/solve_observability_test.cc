// Views that do not tell everything.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <numbers>
#include <string>

#include "part_alignment/pose/solve_test_support.h"

namespace trammel::part_alignment {
namespace {

using Eigen::Matrix3d;
using Eigen::Vector2d;
using test_support::AlignmentWorld;
using test_support::BenchWorld;
using ::testing::HasSubstr;

TEST(Solve, IdenticalLeversAreToldWithTheDirection) {
  AlignmentWorld world = BenchWorld();
  LookFrom(world, [](std::size_t) { return Vector2d(30, 0); });
  const Alignment alignment = Solved(Pictured(world, kSigma_px, 2), Exact());
  EXPECT_EQ(alignment.verdict, Verdict::kCannotTell);
  EXPECT_THAT(alignment.reason, HasSubstr("the clamp angle"));
  EXPECT_THAT(alignment.reason, HasSubstr("no target is seen from two different positions"));
  EXPECT_LT(alignment.observability.rank, 7);
}

TEST(Solve, TargetsOnTheAxisAreTold) {
  AlignmentWorld world = BenchWorld();
  world.camera.taper_from_camera = {{0, 0, -320.3}, {0, 0, 0}};
  world.clamping = {};
  for (std::size_t i = 0; i < world.views.size(); ++i) {
    const Matrix3d turned = geometry::RotationFromAngles({0, 0, i % 2 == 0 ? 0 : std::numbers::pi});
    world.views[i] = ViewOf(world, world.views[i].observations[0].target, turned, 300, {0, 0});
  }
  const Alignment alignment = Solved(Pictured(world, kSigma_px, 2), Exact());
  EXPECT_EQ(alignment.verdict, Verdict::kCannotTell);
  EXPECT_THAT(alignment.reason, HasSubstr("axis"));
}

TEST(Solve, RadialLeversAliasWithThePartsRotation) {
  AlignmentWorld world = BenchWorld();
  world.camera.taper_from_camera = {{0, 0, -320.3}, {0, 0, 0}};
  world.machine_from_part = {{800, 400, -600}, {0, 0, 0}};
  world.clamping = {};
  world.views.clear();
  for (int target = 0; target < 4; ++target) {
    const Vector2d across = world.targets_mm[target].head<2>() / 20;
    world.views.push_back(ViewOf(world, target, Matrix3d::Identity(), 300, across));
  }
  const Alignment alignment = Solved(Pictured(world, kSigma_px, 2), Exact());
  EXPECT_EQ(alignment.verdict, Verdict::kCannotTell) << alignment.reason;
  EXPECT_THAT(alignment.reason,
              HasSubstr("the clamp angle cannot be told from the part's rotation about Z"));
}

TEST(Solve, NearlyUnobservablePlansAreJudgedByTheirUncertainty) {
  AlignmentWorld world = BenchWorld();
  LookFrom(world, [](std::size_t i) { return Vector2d(i % 2 == 0 ? 30 : 30.3, 0); });
  const Alignment alignment = Solved(Pictured(world, kSigma_px, 2), Exact());
  EXPECT_EQ(alignment.verdict, Verdict::kCannotTell);
  EXPECT_THAT(alignment.reason, HasSubstr("known to"));
  EXPECT_EQ(alignment.observability.rank, 7);
  EXPECT_THAT(alignment.reason, HasSubstr("cannot be told well enough from"));
}

TEST(Solve, EccentricityAtOneOrientationIsToldFromNothing) {
  SolveOptions options = Exact();
  options.unknowns.clamp_eccentricity = true;
  const Alignment alignment = Solved(Pictured(BenchWorld(), kSigma_px, 2), options);
  EXPECT_EQ(alignment.verdict, Verdict::kCannotTell);
  EXPECT_THAT(alignment.reason, HasSubstr("the clamp eccentricity in"));
  EXPECT_THAT(alignment.reason, HasSubstr("same orientation of the spindle"));
}

// What is advised is taken, and then the same measurement is good.
TEST(Solve, TheAdvisedViewsMakeTheAnswerGood) {
  AlignmentWorld world = BenchWorld();
  LookFrom(world, [](std::size_t) { return Vector2d(30, 5); });
  const Alignment before = Solved(Pictured(world, kSigma_px, 2), Exact());
  ASSERT_EQ(before.verdict, Verdict::kCannotTell);
  const std::string& advice = before.observability.advice;
  int added = 0;
  for (std::size_t at = advice.find("target T"); at != std::string::npos;
       at = advice.find("target T", at + 1)) {
    int target = 0;
    test_support::WorldView view;
    ASSERT_EQ(std::sscanf(advice.c_str() + at, "target T%d from spindle X %lf Y %lf Z %lf", &target,
                          &view.spindle_mm.x(), &view.spindle_mm.y(), &view.spindle_mm.z()),
              4)
        << advice;
    view.observations = {{target - 1, {}}};
    world.views.push_back(view);
    ++added;
  }
  ASSERT_GE(added, 1) << advice;
  const AlignmentWorld again = Pictured(world, kSigma_px, 2);
  const Alignment after = Solved(again, Exact());
  EXPECT_EQ(after.verdict, Verdict::kGood) << after.reason << "\n" << advice;
}

}  // namespace
}  // namespace trammel::part_alignment
