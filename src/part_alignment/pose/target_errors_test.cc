// What residuals tell of targets of which nobody states how far they are off.
#include "part_alignment/pose/target_errors.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <vector>

#include "part_alignment/pose/joint_fit.h"
#include "part_alignment/pose/solve_input.h"
#include "part_alignment/pose/solve_test_support.h"

namespace trammel::part_alignment {
namespace {

using test_support::AlignmentWorld;
using test_support::BenchWorld;
using ::testing::Contains;
using ::testing::HasSubstr;

constexpr double kUsual_mm = 0.02;
constexpr double kMiddle = 0.5;

/// BenchWorld with its targets' places stated wrong after the pictures.
AlignmentWorld WithTargetsOff(double off_mm, std::uint64_t seed) {
  AlignmentWorld world = Pictured(BenchWorld(300), 0.03, seed);
  Random random(seed + 1000);
  for (auto& target_mm : world.targets_mm) {
    for (double& mm : target_mm) mm += random.Normal(0, off_mm);
  }
  return world;
}

struct Bench {
  explicit Bench(const AlignmentWorld& world) {
    SolveOptions options;
    options.inputs = ExactInputs();
    options.inputs.target_mm = kUsual_mm;
    problem = MakeProblem(MeasurementOf(world, 0.03), options).value();
    theta = ThetaOf(problem, world.machine_from_part, {world.clamping.angle_rad, {}, {}});
  }
  PoseProblem problem;
  Theta theta;
};

TEST(TargetErrors, TheirDirectionsHoldWhatTheyAddToChiSquare) {
  const Bench bench(WithTargetsOff(0.05, 3));
  const TargetDirections directions = DirectionsOfTargets(bench.problem, bench.theta);
  const auto reach2 = directions.reach.array().square();
  const auto residual2 = directions.residual.array().square();
  PoseProblem exact = bench.problem;
  exact.errors.targets.resize(0, 0);
  EXPECT_NEAR(JointChiSquare(exact, bench.theta) - JointChiSquare(bench.problem, bench.theta),
              (residual2 * reach2 / (1 + reach2)).sum(), 1e-6);
  EXPECT_EQ(DirectionsOfTargets(exact, bench.theta).reach.size(), 0);
}

TEST(TargetErrors, OfManySamplesTheirMiddleIsTheTruth) {
  constexpr double kOff_mm = 0.1;
  std::vector<double> found_mm;
  for (std::uint64_t seed = 1; seed <= 200; ++seed) {
    const Bench bench(WithTargetsOff(kOff_mm, seed));
    found_mm.push_back(TargetErrorByResiduals(bench.problem, bench.theta, kUsual_mm, kMiddle));
  }
  std::nth_element(found_mm.begin(), found_mm.begin() + 100, found_mm.end());
  // Half of 200 samples of some six degrees of freedom: the median is known to 4 % (1 sigma).
  EXPECT_NEAR(found_mm[100], kOff_mm, 0.12 * kOff_mm);
}

TEST(TargetErrors, AreNeverBelowTheUsual) {
  const Bench exact(WithTargetsOff(0, 3));
  EXPECT_EQ(TargetErrorByResiduals(exact.problem, exact.theta, kUsual_mm, kMiddle), kUsual_mm);
  Bench few(WithTargetsOff(0.5, 3));
  few.problem.observations.resize(3);  // fewer numbers than unknowns: no residual shows anything
  EXPECT_EQ(TargetErrorByResiduals(few.problem, few.theta, kUsual_mm, kMiddle), kUsual_mm);
}

TEST(TargetErrors, OfWhichNothingIsStatedWidenTheAnswer) {
  const auto usual = Solve(MeasurementOf(WithTargetsOff(0, 5), 0.03), {});
  const auto off = Solve(MeasurementOf(WithTargetsOff(0.1, 5), 0.03), {});
  ASSERT_TRUE(usual && off);
  ASSERT_EQ(usual->verdict, Verdict::kGood) << usual->reason;
  ASSERT_EQ(off->verdict, Verdict::kGood) << off->reason;
  EXPECT_GT(*off->inputs.target_mm, 3 * *usual->inputs.target_mm);
  EXPECT_GT(off->covariance(0, 0), 2 * usual->covariance(0, 0));
  EXPECT_THAT(off->notices, Contains(HasSubstr("measure them on the part")));
  EXPECT_TRUE(usual->notices.empty());
}

TEST(TargetErrors, OneWrongTargetAmongSoundOnesIsNamedAllTheSame) {
  AlignmentWorld world = Pictured(BenchWorld(300), 0.03, 7);
  world.targets_mm[1] += Eigen::Vector3d(0.6, -0.5, 0);
  const auto alignment = Solve(MeasurementOf(world, 0.03), {});
  ASSERT_TRUE(alignment);
  ASSERT_EQ(alignment->verdict, Verdict::kGood) << alignment->reason;
  EXPECT_THAT(alignment->notices, Contains(HasSubstr("left out: target T2")));
  EXPECT_LT(*alignment->inputs.target_mm, 0.1);
  EXPECT_LT(
      (alignment->machine_from_part.translation_mm - world.machine_from_part.translation_mm).norm(),
      0.1);
}

TEST(TargetErrors, BeyondWhatTheAnswerMayBeUncertainByTellNothing) {
  const auto alignment = Solve(MeasurementOf(WithTargetsOff(0.6, 5), 0.03), {});
  ASSERT_TRUE(alignment);
  EXPECT_EQ(alignment->verdict, Verdict::kCannotTell);
  EXPECT_THAT(alignment->reason, HasSubstr("targets that are off by"));
}

}  // namespace
}  // namespace trammel::part_alignment
