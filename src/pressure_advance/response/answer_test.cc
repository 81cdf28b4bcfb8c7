#include "pressure_advance/response/answer.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <string>
#include <vector>

#include "base/random.h"
#include "base/statistics.h"

namespace trammel::pressure_advance {
namespace {

constexpr Interval kTested{0.02, 0.08};

RangedAnswer Judge(double value_s, double half_s, const Interval& tested = kTested) {
  return JudgeInRange(value_s, half_s / 2, half_s, tested, 0.1, "too wide");
}

TEST(TestedRange, GivesNoNumberWhoseIntervalReachesPastAnEdge) {
  for (const double value_s : {0.0781, 0.0799, 0.0801, 0.083, 0.14}) {
    const RangedAnswer judged = Judge(value_s, 0.002);
    EXPECT_EQ(judged.pressure_advance.verdict(), Verdict::kCannotTell) << value_s;
    EXPECT_NE(judged.pressure_advance.reason().find("above the tested range"), std::string::npos);
    ASSERT_TRUE(judged.print_next_s) << value_s;
    EXPECT_LT(judged.print_next_s->lo, value_s);
    EXPECT_GT(judged.print_next_s->hi, value_s);
  }
  for (const double value_s : {0.0219, 0.0201, 0.0199, 0.01, -0.03}) {
    const RangedAnswer judged = Judge(value_s, 0.002);
    EXPECT_EQ(judged.pressure_advance.verdict(), Verdict::kCannotTell) << value_s;
    EXPECT_NE(judged.pressure_advance.reason().find("below the tested range"), std::string::npos);
    ASSERT_TRUE(judged.print_next_s) << value_s;
    EXPECT_GE(judged.print_next_s->lo, 0);
    EXPECT_GT(judged.print_next_s->hi, judged.print_next_s->lo);
  }
}

TEST(TestedRange, ZeroIsNoEdgeBecauseNothingLiesBelow) {
  const Interval from_zero{0, 0.06};
  const RangedAnswer near = Judge(0.001, 0.003, from_zero);
  ASSERT_TRUE(near.pressure_advance.good()) << near.pressure_advance.reason();
  EXPECT_EQ(near.pressure_advance.quantity().interval95.lo, 0);
  EXPECT_DOUBLE_EQ(near.pressure_advance.quantity().interval95.hi, 0.004);
  const RangedAnswer negative = Judge(-0.002, 0.003, from_zero);
  ASSERT_TRUE(negative.pressure_advance.good());
  const Quantity& q = negative.pressure_advance.quantity();
  EXPECT_EQ(q.value, 0);
  EXPECT_GE(q.interval95.hi - q.interval95.lo, 2 * q.standard_uncertainty);
  const RangedAnswer nonsense = Judge(-0.01, 0.003, from_zero);
  EXPECT_EQ(nonsense.pressure_advance.verdict(), Verdict::kCannotTell);
  EXPECT_NE(nonsense.pressure_advance.reason().find("below 0"), std::string::npos);
  EXPECT_FALSE(nonsense.print_next_s);
}

TEST(TestedRange, BlamesTheWidthOfAnIntervalOnlyInside) {
  EXPECT_EQ(Judge(0.05, 0.01).pressure_advance.reason(), "too wide");
  EXPECT_NE(Judge(0.1, 0.01).pressure_advance.reason(), "too wide");
}

constexpr Interval kTested_s{0, 0.06};

std::string ReasonOf(const UncertaintyBudget& budget) {
  return JudgeByBudget(0.03, budget, 7, kTested_s, 0.1).pressure_advance.reason();
}

TEST(UncertaintyBudget, BlamesTheLargestContributionForAnIntervalThatIsTooWide) {
  constexpr double kMuch_s2 = 4e-5;
  EXPECT_NE(ReasonOf({.lines = kMuch_s2}).find("print more lines"), std::string::npos);
  for (const UncertaintyBudget& budget : {UncertaintyBudget{.unread = kMuch_s2},
                                          UncertaintyBudget{.lines = 1e-6, .unread = kMuch_s2}}) {
    EXPECT_NE(ReasonOf(budget).find("crop_px"), std::string::npos) << ReasonOf(budget);
    EXPECT_EQ(ReasonOf(budget).find("more lines"), std::string::npos) << ReasonOf(budget);
  }
  EXPECT_NE(ReasonOf({.slip = kMuch_s2}).find("may be lost at the fast speed"), std::string::npos);
  EXPECT_NE(ReasonOf({.drift = kMuch_s2}).find("drift"), std::string::npos);
  EXPECT_NE(ReasonOf({.form = kMuch_s2}).find("outlasts"), std::string::npos);
  EXPECT_NE(ReasonOf({.apart = kMuch_s2}).find("contradict"), std::string::npos);
}

TEST(UncertaintyBudget, WidensByStudentsTForTheLinesPartAlone) {
  const auto half_s = [](const UncertaintyBudget& budget) {
    const Quantity q = JudgeByBudget(0.03, budget, 2, kTested_s, 1).pressure_advance.quantity();
    return (q.interval95.hi - q.interval95.lo) / 2;
  };
  EXPECT_NEAR(half_s({.lines = 1e-6}), 4.303e-3, 1e-6);
  EXPECT_NEAR(half_s({.slip = 1e-6}), 1.960e-3, 1e-6);
}

constexpr double kWidest = 0.1;

Quantity About(double value_s, double u_s) {
  return {value_s, u_s, {value_s - kNormal95 * u_s, value_s + kNormal95 * u_s}};
}

std::vector<Measured> Patterns(const std::vector<double>& values_s, double u_s) {
  std::vector<Measured> patterns;
  for (const double value_s : values_s) patterns.push_back(Measured::Good(About(value_s, u_s)));
  return patterns;
}

double Half_s(const Measured& measured) {
  const Interval& interval = measured.quantity().interval95;
  return (interval.hi - interval.lo) / 2;
}

std::pair<RangedAnswer, Repeats> Combined(const Quantity& joint,
                                          const std::vector<double>& values_s, double u_s) {
  return CombineRepeats(joint, Patterns(values_s, u_s), kTested_s, kWidest);
}

TEST(Repeats, AreTheMeanOfThePatterns) {
  const auto repeated = Combined(About(0.037, 0.0004), {0.035, 0.036, 0.0355}, 0.0007);
  ASSERT_TRUE(repeated.first.pressure_advance.good());
  EXPECT_NEAR(repeated.first.pressure_advance.quantity().value, 0.0355, 1e-9);
  EXPECT_NEAR(repeated.second.scatter_s, 0.0005, 1e-9);
  EXPECT_FALSE(repeated.second.disagree);
  EXPECT_EQ(NoticeOfRepeats(repeated.second), "");
}

TEST(Repeats, AreNeverNarrowerThanTheJointFit) {
  const Quantity joint = About(0.036, 0.0005);
  const double joint_s = kNormal95 * 0.0005;
  for (const int count : {2, 3, 9}) {
    const std::vector<double> same(static_cast<std::size_t>(count), 0.036);
    const double half_s = Half_s(Combined(joint, same, 0.0007).first.pressure_advance);
    EXPECT_GT(half_s, joint_s) << count;
    EXPECT_LT(half_s, 2 * joint_s) << count;
  }
}

TEST(Repeats, WidenByWhatTheirIntervalsDoNotExplain) {
  const auto repeated = Combined(About(0.036, 0.0003), {0.033, 0.036, 0.039, 0.036}, 0.0005);
  EXPECT_TRUE(repeated.second.disagree);
  // Student's interval of four values that scatter by 2.45 ms: 3.18 * 2.45 / 2 = 3.9 ms.
  EXPECT_GT(Half_s(repeated.first.pressure_advance), 0.0025);
  EXPECT_LT(Half_s(repeated.first.pressure_advance), 0.0045);
  EXPECT_THAT(NoticeOfRepeats(repeated.second), ::testing::HasSubstr("0.0024 s"));
  EXPECT_GT(repeated.second.between_s, 0.0015);
}

TEST(Repeats, ThatDifferByMoreThanTheRangeAllowsAreNoAnswer) {
  const auto repeated = Combined(About(0.036, 0.0003), {0.02, 0.052}, 0.0005);
  EXPECT_EQ(repeated.first.pressure_advance.verdict(), Verdict::kCannotTell);
}

TEST(Repeats, KeepTheJointValueWhereAPatternHasNoneOfItsOwn) {
  std::vector<Measured> patterns = Patterns({0.035, 0.0352}, 0.0007);
  patterns.push_back(Measured::CannotTell("the lines scatter too much"));
  const auto repeated = CombineRepeats(About(0.036, 0.0005), patterns, kTested_s, kWidest);
  ASSERT_TRUE(repeated.first.pressure_advance.good());
  EXPECT_EQ(repeated.first.pressure_advance.quantity().value, 0.036);
  EXPECT_EQ(repeated.second.pattern_s.size(), 3U);
  EXPECT_NEAR(repeated.second.scatter_s, 0.00014, 1e-5);
}

TEST(Repeats, HoldTheTruthAsOftenAsTheySay) {
  constexpr int kRuns = 500;
  // The prior is no truth: 3 % are twice its median, of which few patterns show little. Less two
  // standard deviations of the draws.
  constexpr double kMin = 0.88;
  constexpr double kTruth_s = 0.036, kEach_s = 0.0006;
  Random random(41);
  for (const int count : {2, 3, 5, 9}) {
    for (const double between : {0.0, 0.01, 0.03}) {
      int held = 0;
      for (int run = 0; run < kRuns; ++run) {
        std::vector<double> values_s;
        double mean_s = 0;
        for (int k = 0; k < count; ++k) {
          values_s.push_back(kTruth_s * (1 + between * random.Normal()) +
                             kEach_s * random.Normal());
          mean_s += values_s.back() / count;
        }
        const auto repeated = CombineRepeats(About(mean_s, kEach_s / std::sqrt(count)),
                                             Patterns(values_s, kEach_s), kTested_s, 1);
        const Interval& interval = repeated.first.pressure_advance.quantity().interval95;
        held += interval.lo <= kTruth_s && kTruth_s <= interval.hi;
      }
      std::printf("%d patterns, %.0f %% between: %.1f %%\n", count, 100 * between,
                  100.0 * held / kRuns);
      EXPECT_GE(held, kMin * kRuns) << count << " " << between;
    }
  }
}

}  // namespace
}  // namespace trammel::pressure_advance
