// Observations and targets that are wrong: left out and named, or refused.
#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <numbers>
#include <string>

#include "base/statistics.h"
#include "geometry/linear_systems.h"
#include "part_alignment/pose/solve_test_support.h"
#include "support/matchers.h"

namespace trammel::part_alignment {
using Eigen::Matrix3d;
using Eigen::Vector2d;
using Eigen::Vector3d;
using test_support::AlignmentWorld;
using test_support::BenchWorld;
using ::testing::HasSubstr;
using ::testing::StartsWith;

namespace {

TEST(Solve, OneWrongObservationIsNamedAndLeftOut) {
  const AlignmentWorld world = Pictured(BenchWorld(), kSigma_px, 4);
  Measurement measurement = MeasurementOf(world, kSigma_px);
  measurement.views[3].observations[0].column_px += 5;
  const auto alignment = Good(Solve(measurement, Exact()));
  ASSERT_EQ(alignment.notices.size(), 1);
  EXPECT_THAT(alignment.notices[0], StartsWith("left out: target T2 in view 4, "));
  EXPECT_THAT(alignment.notices[0], HasSubstr(" px beside where the others put it"));
  EXPECT_EQ(alignment.residuals[3].weight, 0);
  EXPECT_NEAR(alignment.residuals[3].column_px, 5, 1);
  EXPECT_LT(
      (alignment.machine_from_part.translation_mm - world.machine_from_part.translation_mm).norm(),
      0.1);
  SolveOptions strict = Exact();
  strict.robust = false;
  EXPECT_THAT(Solve(measurement, strict), Answers(Verdict::kRefused, "chi-square"));
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
    const auto alignment = Must(Solve(measurement, Exact()));
    if (alignment.verdict == Verdict::kGood) {
      EXPECT_EQ(alignment.residuals[wrong].weight, 0);
      named += 1;
    }
  }
  // Seven of eight observations leave seven degrees of freedom, enough to settle which.
  EXPECT_GE(named, kWorlds * 95 / 100);
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
  const auto alignment = Good(Solve(measurement, Exact()));
  EXPECT_THAT(alignment.notices.at(0), HasSubstr("in view 3, which look exchanged"));
}

TEST(Solve, RefusesWhereTheRestCannotTellWhoIsWrong) {
  AlignmentWorld world = BenchWorld();
  world.views.resize(6);  // three targets
  Measurement measurement = MeasurementOf(Pictured(world, kSigma_px, 4), kSigma_px);
  measurement.targets[0].ideal_mm.x() += 3;
  EXPECT_THAT(Solve(measurement, Exact()), Answers(Verdict::kRefused, "without it: "));
}

// Eight targets on a part of 1.5 × 1 m, each in a picture from either side, one round after the
// other, twice.
AlignmentWorld TwoRounds() {
  AlignmentWorld world = test_support::BenchWorld();
  world.targets_mm = {{-750, -500, 0}, {0, -480, 12}, {750, -500, 12}, {740, 0, -20},
                      {750, 500, -7},  {10, 510, 25}, {-750, 500, 4},  {-735, 20, 15}};
  world.views.clear();
  for (int round = 0; round < 2; ++round) {
    for (int target = 0; target < 8; ++target) {
      for (const double side : {-38.0, 38.0}) {
        const Vector2d across = target % 2 == 0 ? Vector2d(side, 0) : Vector2d(0, side);
        world.views.push_back(ViewOf(world, target, Matrix3d::Identity(), 300, across));
      }
    }
  }
  return world;
}

// The verdict, where the answer is not good and beyond all chance.
Verdict CheckedVerdict(const AlignmentWorld& world, const Alignment& alignment) {
  if (alignment.verdict != Verdict::kGood) {
    EXPECT_NE(alignment.reason, "");
    return alignment.verdict;
  }
  Eigen::VectorXd error(7);
  error << PartError(world, alignment), alignment.clamping.angle_rad - world.clamping.angle_rad;
  for (Eigen::Index i = 3; i < 7; ++i) error[i] = std::remainder(error[i], 2 * std::numbers::pi);
  const double nees = geometry::SquaredMahalanobisDistance(alignment.covariance, error);
  EXPECT_LT(nees, ChiSquareQuantile(1 - 1e-5, 7)) << "off by " << error.head<3>().transpose();
  return alignment.verdict;
}

TEST(SolveContradiction, APartOfThePartThatMovedIsNeverGoodAndWrong) {
  for (const bool stated : {true, false}) {
    for (const int moved : {2, 4}) {
      for (const double by_mm : {0.1, 1.0, 5.0}) {
        for (const bool half_way : {true, false}) {
          SCOPED_TRACE(fmt::format("{} of 8 targets by {} mm {}, {}", moved, by_mm,
                                   half_way ? "between two rounds" : "before all pictures",
                                   stated ? "all stated" : "nothing stated"));
          const AlignmentWorld still = TwoRounds();
          AlignmentWorld world = still;
          for (int t = 0; t < moved; ++t) {
            world.targets_mm[static_cast<std::size_t>(t)] += by_mm * Vector3d(0.6, 0.8, 0.1);
          }
          AlignmentWorld before = Pictured(still, kSigma_px, 5);
          const AlignmentWorld after = Pictured(world, kSigma_px, 5);
          for (std::size_t v = half_way ? 16 : 0; v < 32; ++v) before.views[v] = after.views[v];
          const auto alignment =
              Must(Solve(MeasurementOf(before, kSigma_px), stated ? Exact() : SolveOptions{}));
          const Verdict verdict = CheckedVerdict(still, alignment);
          if (stated) EXPECT_NE(verdict, Verdict::kGood);
        }
      }
    }
  }
}

TEST(SolveContradiction, CodesReadAsOthersAreNeverGoodAndWrong) {
  for (const double share : {0.1, 0.33, 0.6}) {
    for (const bool swapped : {false, true}) {
      for (const int pairs : {1, 3}) {
        SCOPED_TRACE(
            fmt::format("{} pairs {} in {}", pairs, swapped ? "swapped" : "misread", share));
        const AlignmentWorld world = Pictured(TwoRounds(), kSigma_px, 6);
        Measurement measurement = MeasurementOf(world, kSigma_px);
        Random random(7);
        for (View& view : measurement.views) {
          if (random.Uniform(0, 1) >= share) continue;
          for (int k = 0; k < pairs; ++k) {
            const std::string from = TargetId(k);
            const std::string to = TargetId(k + 4);
            for (Observation& seen : view.observations) {
              if (seen.target == from) {
                seen.target = to;
              } else if (swapped && seen.target == to) {
                seen.target = from;
              }
            }
          }
        }
        const auto alignment = Must(Solve(measurement, {}));
        (void)CheckedVerdict(world, alignment);
      }
    }
  }
}

TEST(SolveContradiction, MoreThanOutliersCanBeIsNoAnswer) {
  const AlignmentWorld world = Pictured(TwoRounds(), kSigma_px, 8);
  Measurement measurement = MeasurementOf(world, kSigma_px);
  const auto sound = Solve(measurement, Exact());
  ASSERT_EQ(sound->verdict, Verdict::kGood) << sound->reason;
  EXPECT_EQ(sound->check.observations, 32);
  EXPECT_EQ(sound->check.rejected, 0);
  EXPECT_EQ(sound->check.redundancy, sound->degrees_of_freedom);
  // A whole target, and no more.
  for (View& view : measurement.views) {
    if (view.observations[0].target == "T2") view.observations[0].column_px += 20;
  }
  const auto one = Solve(measurement, Exact());
  EXPECT_EQ(CheckedVerdict(world, *one), Verdict::kGood) << one->reason;
  EXPECT_EQ(one->check.rejected, 4);
}

}  // namespace

}  // namespace trammel::part_alignment
