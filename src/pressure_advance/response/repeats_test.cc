#include "pressure_advance/response/repeats.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <string>
#include <vector>

#include "base/random.h"
#include "base/statistics.h"

namespace trammel::pressure_advance {
namespace {

constexpr Interval kTested_s{0, 0.06};
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
                                          const std::vector<double>& values_s, double u_s,
                                          const RepeatOptions& options = {}) {
  return CombineRepeats(joint, Patterns(values_s, u_s), kTested_s, kWidest, options);
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

TEST(Repeats, WithoutAPriorAndScatterAreTheJointFit) {
  RepeatOptions none;
  none.prior_median = 1e-9;
  const auto repeated = Combined(About(0.036, 0.0005), {0.0358, 0.0362}, 0.0007, none);
  EXPECT_NEAR(Half_s(repeated.first.pressure_advance), kNormal95 * 0.0005, 1e-6);
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

TEST(Repeats, TrustALargeScatterOfTwoLessThanTheSameOfMany) {
  const Quantity joint = About(0.036, 0.0003);
  const auto two = Combined(joint, {0.035, 0.037}, 0.0005);
  const auto nine = Combined(
      joint, {0.0346, 0.0374, 0.0346, 0.0374, 0.0346, 0.0374, 0.0346, 0.0374, 0.036}, 0.0005);
  EXPECT_GT(Half_s(two.first.pressure_advance), 1.5 * Half_s(nine.first.pressure_advance));
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

TEST(Repeats, OfNoneThatIsGoodKnowNoScatter) {
  const std::vector<Measured> patterns(2, Measured::Refused("too few lines"));
  const auto repeated = CombineRepeats(About(0.036, 0.0005), patterns, kTested_s, kWidest);
  ASSERT_TRUE(repeated.first.pressure_advance.good());
  EXPECT_EQ(repeated.second.scatter_s, 0);
  EXPECT_FALSE(repeated.second.disagree);
  EXPECT_GT(Half_s(repeated.first.pressure_advance), kNormal95 * 0.0005);
}

TEST(Repeats, HoldTheTruthAsOftenAsTheySay) {
  constexpr int kRuns = 500;
  // The prior is no truth: 3 % are twice its median, of which few patterns show little. Less two
  // standard deviations of the draws.
  constexpr double kLeast = 0.88;
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
      EXPECT_GE(held, kLeast * kRuns) << count << " " << between;
    }
  }
}

}  // namespace
}  // namespace trammel::pressure_advance
