#include "pressure_advance/response/improvement.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>

#include "base/random.h"
#include "pressure_advance/response/lag_line_test_support.h"

namespace trammel::pressure_advance {
namespace {

using ::testing::HasSubstr;

constexpr double kCalibrated_s = 0.036;

struct Recorded {
  std::vector<LineProfile> profiles;
  std::vector<std::optional<double>> score_px;

  [[nodiscard]] Improvement Compare() const {
    return CompareWithControl(profiles, score_px, MotionOf({}));
  }
};

LineProfile Printed(double pressure_advance_s, double noise, Random& random) {
  return ReadLagLine({}, {.linear_s = kCalibrated_s}, pressure_advance_s, noise, random);
}

// `lines` of either kind, in turn.
Recorded Record(int lines, double calibrated_s, double noise, std::uint64_t seed) {
  Random random(seed);
  Recorded recorded;
  for (int i = 0; i < lines; ++i) {
    for (const double value_s : {0.0, calibrated_s}) {
      recorded.profiles.push_back(Printed(value_s, noise, random));
      recorded.score_px.emplace_back(value_s == 0 ? 100 : 20);
    }
  }
  return recorded;
}

TEST(Improvement, IsWhatDeviationAndSurplusFellBy) {
  constexpr double kTail = 0.05;  // of the lag, that the windows do not hold
  for (const auto& [share, seed] : {std::pair{1.0, 2}, {0.5, 3}}) {
    const Recorded recorded = Record(5, share * kCalibrated_s, 0.01, seed);
    const Improvement improvement = recorded.Compare();
    ASSERT_TRUE(improvement.surplus_left.good()) << improvement.surplus_left.reason();
    EXPECT_NEAR(improvement.surplus_left.quantity().value, 1 - share, kTail);
    ASSERT_TRUE(improvement.deviation.good()) << improvement.deviation.reason();
    EXPECT_DOUBLE_EQ(improvement.deviation.quantity().value, 0.8);
  }
  Recorded worse = Record(4, kCalibrated_s, 0, 5);
  for (std::size_t i = 1; i < worse.score_px.size(); i += 2) worse.score_px[i] = 150;
  EXPECT_DOUBLE_EQ(worse.Compare().deviation.quantity().value, -0.5);
}

TEST(Improvement, ItsIntervalHoldsTheTruth) {
  // 95 % of 1000 within 3 sigma of the count, and a little more for the first-order propagation.
  constexpr int kRepeats = 1000;
  constexpr double kTruth = 1 - 20.0 / 100;
  constexpr std::uint64_t kSeed = 4;
  Random random(kSeed);
  const Recorded recorded = Record(5, kCalibrated_s, 0, 1);
  int held = 0;
  for (int repeat = 0; repeat < kRepeats; ++repeat) {
    std::vector<std::optional<double>> score_px;
    for (const auto& mean : recorded.score_px) {
      score_px.emplace_back(*mean * (1 + 0.15 * random.Normal()));
    }
    const Measured measured =
        CompareWithControl(recorded.profiles, score_px, MotionOf({})).deviation;
    ASSERT_TRUE(measured.good()) << measured.reason();
    const Interval interval = measured.quantity().interval95;
    held += interval.lo <= kTruth && kTruth <= interval.hi;
  }
  EXPECT_GE(held, 925) << "seed " << kSeed;
  EXPECT_LE(held, 980) << "seed " << kSeed;
}

TEST(Improvement, RefusesTooFewLinesAndQuotesTheReasonOfOne) {
  Recorded recorded = Record(3, kCalibrated_s, 0, 6);
  recorded.profiles[2].unusable = "no laser in 40 of 80 frames";
  const Improvement improvement = recorded.Compare();
  for (const Measured* measured : {&improvement.deviation, &improvement.surplus_left}) {
    EXPECT_EQ(measured->verdict(), Verdict::kRefused);
    EXPECT_THAT(measured->reason(), HasSubstr("2 control and 3 calibrated"));
    EXPECT_THAT(measured->reason(), HasSubstr("no laser in 40 of 80 frames"));
  }
}

TEST(Improvement, RefusesARecordingThatIsNoComparison) {
  Random random(7);
  for (const auto& values_s : {std::vector{0.0, 0.0}, std::vector{0.0, 0.02, 0.04}}) {
    std::vector<LineProfile> profiles;
    for (const double value_s : values_s) profiles.push_back(Printed(value_s, 0, random));
    const std::vector<std::optional<double>> score_px(values_s.size(), 10.0);
    const Improvement improvement = CompareWithControl(profiles, score_px, MotionOf({}));
    EXPECT_EQ(improvement.deviation.verdict(), Verdict::kRefused);
    EXPECT_THAT(improvement.deviation.reason(), HasSubstr("two"));
  }
}

TEST(Improvement, CannotTellWhereTheLinesScatterTooMuch) {
  Recorded recorded = Record(3, kCalibrated_s, 0, 8);
  recorded.score_px = {20, 10, 100, 80, 180, 170};
  EXPECT_EQ(recorded.Compare().deviation.verdict(), Verdict::kCannotTell);
}

}  // namespace
}  // namespace trammel::pressure_advance
