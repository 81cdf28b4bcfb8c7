#include "part_alignment/budget/budget.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <limits>

#include "support/matchers.h"

namespace trammel::part_alignment {
namespace {

using Eigen::Vector3d;
using ::testing::Each;
using ::testing::HasSubstr;

// The laboratory part of the literature: four targets at the corners of 1.5 x 1 m.
BudgetScene Laboratory() {
  BudgetScene scene;
  scene.targets_mm = {{0, 0, 0}, {1500, 0, 0}, {1500, 1000, 0}, {0, 1000, 0}};
  scene.target_sigma_mm = {0.0035, 0.0143, 0.0155};
  scene.high_mm = {1500, 1000, 500};
  return scene;
}

TEST(Budget, TermsAreWhatTheirFormulasSay) {
  Random random(81);
  const auto budget = Must(MakeBudget(Laboratory(), 0, random));
  // 11e-6 · 1500 mm · 1 K / sqrt(3), as Table 4 of the literature has it: 9.5, 6.4, 3.2 µm.
  EXPECT_NEAR(budget.axes[0].u_it_mm, 0.009526, 1e-6);
  EXPECT_NEAR(budget.axes[1].u_it_mm, 0.006351, 1e-6);
  EXPECT_NEAR(budget.axes[2].u_it_mm, 0.003175, 1e-6);
  // (50 µm + 20 µm/m · L) / sqrt(3).
  EXPECT_NEAR(budget.axes[0].u_out_mm, 0.080 / std::sqrt(3), 1e-9);
  EXPECT_NEAR(budget.axes[2].u_out_mm, 0.060 / std::sqrt(3), 1e-9);
  const AxisBudget& x = budget.axes[0];
  EXPECT_NEAR(x.expanded_mm, 2 * std::hypot(x.u_out_mm, x.u_ip_mm, x.u_it_mm), 1e-15);
}

// A rectangle's fit splits: translation sigma/2, turns about its own axes by sums of squares.
TEST(Budget, ThePosesShareIsTheClosedFormOfARectangle) {
  BudgetScene scene = Laboratory();
  const auto u_ip_mm = [&scene](const Vector3d& at_mm) {
    scene.low_mm = scene.high_mm = at_mm;
    Random random(80);
    return MakeBudget(scene, 0, random).value().axes;
  };
  const auto middle = u_ip_mm({750, 500, 0});
  for (int i = 0; i < 3; ++i) EXPECT_NEAR(middle[i].u_ip_mm, scene.target_sigma_mm[i] / 2, 1e-12);
  // 400 mm above the middle the turns about x and y, from z alone, join: z / (2 · half edge).
  const auto above = u_ip_mm({750, 500, 400});
  const double by_beta = 400 * 0.0155 / (2 * 750);
  const double by_alpha = 400 * 0.0155 / (2 * 500);
  EXPECT_NEAR(above[0].u_ip_mm, std::hypot(0.0035 / 2, by_beta), 1e-12);
  EXPECT_NEAR(above[1].u_ip_mm, std::hypot(0.0143 / 2, by_alpha), 1e-12);
}

TEST(Budget, SimulationAndLinearSumAgree) {
  BudgetScene scene = Laboratory();
  scene.pose_sigma << 0.016, 0.015, 0.010, 14e-6, 12e-6, 5e-6;
  constexpr int kTrials = 40'000;
  const std::uint64_t seed = 82;
  Random random(seed);
  const auto budget = Must(MakeBudget(scene, kTrials, random));
  for (const AxisBudget& axis : budget.axes) {
    // Standard deviation of a standard deviation: 1 / sqrt(2 n); five of them.
    EXPECT_NEAR(axis.simulated_mm / axis.combined_mm, 1, 5 / std::sqrt(2.0 * kTrials)) << seed;
    // With a rectangular share, 95 % ends below 1.96 sigma, and k = 2 always covers it.
    EXPECT_LT(axis.simulated_expanded_mm, 1.98 * axis.combined_mm);
    EXPECT_GT(axis.simulated_expanded_mm, 1.65 * axis.combined_mm);
  }
}

TEST(Budget, FewRepeatsWidenTheCoverageFactor) {
  BudgetScene scene = Laboratory();
  scene.out_sigma_mm = Vector3d(1e-9, 1e-9, 1e-9);
  scene.temperature_half_width_k = 0;
  Random random(83);
  const auto few = Must(MakeBudget(scene, 0, random));
  EXPECT_NEAR(few.axes[2].degrees_of_freedom, 9, 1e-6);
  EXPECT_NEAR(few.axes[2].coverage_factor, 2.262, 1e-3) << "Student's t, tabulated";
  scene.repeats = 0;
  EXPECT_NEAR(MakeBudget(scene, 0, random)->axes[2].coverage_factor, 1.960, 1e-3);
}

TEST(Budget, WhatCannotBeIsNamed) {
  Random random(84);
  const auto complaint = [&](const BudgetScene& scene, int trials = 0) {
    return ErrorOf(MakeBudget(scene, trials, random));
  };
  BudgetScene scene = Laboratory();
  scene.targets_mm.resize(2);
  EXPECT_THAT(complaint(scene), HasSubstr("2 targets"));
  scene.targets_mm = {{0, 0, 0}, {500, 0, 0}, {1500, 0, 0}};
  EXPECT_THAT(complaint(scene), HasSubstr("one line"));
  scene = Laboratory();
  scene.target_sigma_mm.y() = 0;
  EXPECT_THAT(complaint(scene), HasSubstr("above 0"));
  scene = Laboratory();
  scene.high_mm.z() = -1;
  EXPECT_THAT(complaint(scene), HasSubstr("before it begins"));
  scene = Laboratory();
  scene.targets_mm[1].x() = std::numeric_limits<double>::quiet_NaN();
  EXPECT_THAT(complaint(scene), HasSubstr("finite"));
  EXPECT_THAT(complaint(Laboratory(), 2'000'000'000), HasSubstr("trials"));
}

TEST(LengthErrors, AreJudgedAgainstTheLimitOfTheirLength) {
  const std::vector<MeasuredLength> lengths = {{500, 500.05}, {1000, 999.93}, {1500, 1500.08}};
  const auto judged = Must(JudgeLengths(lengths, 0.05, 20e-6));
  EXPECT_NEAR(judged.largest_mm, 0.08, 1e-9);
  EXPECT_EQ(judged.worst, 2U);
  EXPECT_TRUE(judged.within) << "0.06, 0.07 and 0.08 mm are allowed";
  EXPECT_THAT(judged.notices, Each(HasSubstr("2634")));
  EXPECT_FALSE(JudgeLengths(lengths, 0.05, 10e-6)->within);
  EXPECT_FALSE(JudgeLengths({}, 0.05, 0));
}

TEST(Capability, IsOfTheFullWidthOfTheTolerance) {
  const Capability capability = JudgeCapability(0.336, -1, 1);
  EXPECT_NEAR(capability.ratio, 0.168, 1e-12);
  EXPECT_TRUE(capability.capable);
  EXPECT_NEAR(capability.ratio_of_half_width, 0.336, 1e-12);
  EXPECT_FALSE(JudgeCapability(0.45, -1, 1).capable);
}

}  // namespace
}  // namespace trammel::part_alignment
