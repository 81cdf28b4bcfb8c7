// Observations and targets that are wrong: left out and named, or refused.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <numbers>

#include "part_alignment/pose/solve_test_support.h"

namespace trammel::part_alignment {
namespace {

using Eigen::Matrix3d;
using Eigen::Vector2d;
using Eigen::Vector3d;
using test_support::AlignmentWorld;
using test_support::BenchWorld;
using ::testing::HasSubstr;
using ::testing::StartsWith;

TEST(Solve, OneWrongObservationIsNamedAndLeftOut) {
  const AlignmentWorld world = Pictured(BenchWorld(), kSigma_px, 4);
  Measurement measurement = MeasurementOf(world, kSigma_px);
  measurement.views[3].observations[0].column_px += 5;
  const auto alignment = Solve(measurement, Exact());
  ASSERT_TRUE(alignment);
  ASSERT_EQ(alignment->verdict, Verdict::kGood) << alignment->reason;
  ASSERT_EQ(alignment->notices.size(), 1);
  EXPECT_THAT(alignment->notices[0], StartsWith("left out: target T2 in view 4, "));
  EXPECT_THAT(alignment->notices[0], HasSubstr(" px beside where the others put it"));
  EXPECT_EQ(alignment->residuals[3].weight, 0);
  EXPECT_NEAR(alignment->residuals[3].column_px, 5, 1);
  EXPECT_LT(
      (alignment->machine_from_part.translation_mm - world.machine_from_part.translation_mm).norm(),
      0.1);
  SolveOptions strict = Exact();
  strict.robust = false;
  const auto refused = Solve(measurement, strict);
  ASSERT_TRUE(refused);
  EXPECT_EQ(refused->verdict, Verdict::kRefused);
  EXPECT_THAT(refused->reason, HasSubstr("chi-square"));
}

TEST(Solve, NeverNamesTheWrongObservation) {
  constexpr std::uint64_t kSeed = 40;
  constexpr int kWorlds = 100;
  SCOPED_TRACE(kSeed);
  Random random(kSeed);
  int named = 0;
  for (int i = 0; i < kWorlds; ++i) {
    const AlignmentWorld world = Pictured(BenchWorld(), kSigma_px, kSeed + i);
    Measurement measurement = MeasurementOf(world, kSigma_px);
    const std::size_t wrong = random.Below(measurement.views.size());
    Observation& observation = measurement.views[wrong].observations[0];
    const double angle = random.Uniform(0, 2 * std::numbers::pi);
    observation.column_px += 5 * std::cos(angle);
    observation.row_px += 5 * std::sin(angle);
    const auto alignment = Solve(measurement, Exact());
    ASSERT_TRUE(alignment);
    if (alignment->verdict == Verdict::kGood) {
      EXPECT_EQ(alignment->residuals[wrong].weight, 0);
      named += 1;
    }
  }
  // Seven of eight observations leave seven degrees of freedom, enough to settle which.
  EXPECT_GE(named, kWorlds * 95 / 100);
}

TEST(Solve, AWrongTargetIsNamedAndLeftOut) {
  AlignmentWorld world = BenchWorld();
  world.targets_mm.push_back({100, 200, 30});
  for (const double side : {-30.0, 30.0}) {
    world.views.push_back(ViewOf(world, 4, Matrix3d::Identity(), 300, {side, side}));
  }
  world = Pictured(world, kSigma_px, 4);
  world.targets_mm[1] += Vector3d(0.7, -0.4, 0);  // after the pictures: the list is wrong
  const auto alignment = Solve(MeasurementOf(world, kSigma_px), Exact());
  ASSERT_TRUE(alignment);
  ASSERT_EQ(alignment->verdict, Verdict::kGood) << alignment->reason;
  EXPECT_THAT(alignment->notices.at(0), StartsWith("left out: target T2, "));
}

TEST(Solve, ExchangedIdsAreNamed) {
  AlignmentWorld world = BenchWorld();
  world.targets_mm = {{-40, -30, 0}, {45, -28, 2}, {38, 30, -3}, {-41, 27, 1}, {2, 5, 8}};
  world.views.clear();
  for (const Vector2d& across :
       {Vector2d(-25, -10), Vector2d(30, 15), Vector2d(0, -30), Vector2d(0, 30)}) {
    test_support::WorldView view = ViewOf(world, 4, Matrix3d::Identity(), 300, across);
    view.observations = {{0, {}}, {1, {}}, {2, {}}, {3, {}}, {4, {}}};
    world.views.push_back(view);
  }
  world = Pictured(world, kSigma_px, 4);
  Measurement measurement = MeasurementOf(world, kSigma_px);
  std::swap(measurement.views[2].observations[1].target,
            measurement.views[2].observations[3].target);
  const auto alignment = Solve(measurement, Exact());
  ASSERT_TRUE(alignment);
  ASSERT_EQ(alignment->verdict, Verdict::kGood) << alignment->reason;
  EXPECT_THAT(alignment->notices.at(0), HasSubstr("in view 3, which look exchanged"));
}

TEST(Solve, RefusesWhereTheRestCannotTellWhoIsWrong) {
  AlignmentWorld world = BenchWorld();
  world.views.resize(6);  // three targets
  Measurement measurement = MeasurementOf(Pictured(world, kSigma_px, 4), kSigma_px);
  measurement.targets[0].ideal_mm.x() += 3;
  const auto alignment = Solve(measurement, Exact());
  ASSERT_TRUE(alignment);
  EXPECT_EQ(alignment->verdict, Verdict::kRefused);
  EXPECT_THAT(alignment->reason, HasSubstr("without it: "));
}

}  // namespace
}  // namespace trammel::part_alignment
