#include "pressure_advance/response/surplus.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <vector>

#include "base/random.h"
#include "base/statistics.h"

namespace trammel::pressure_advance {
namespace {

using ::testing::HasSubstr;

constexpr double kStep_mm = 0.1;
constexpr double kArea_mm2 = 0.11;
constexpr double kSigma = 0.0011;  // per reading: 1 % of the area

// Two windows between two slow stretches.
TransitionPlan Plan() {
  TransitionPlan plan;
  plan.reference = {{1, 7}, {24, 29}};
  plan.acceleration = {{7, 17}, 7.5, 145, 9.5};
  plan.deceleration = {{17, 24}, 22.5, -145, 5.5};
  return plan;
}

// A steady line with a bump of `missing_mm` less (of nominal bead) after the acceleration and
// `left_over_mm` more after the deceleration.
LineProfile Line(double missing_mm, double left_over_mm, double drift_per_mm = 0) {
  LineProfile profile;
  const auto bump = [](double position, double at) {  // 4 mm wide, integral 1
    const double u = (position - at) / 2;
    return std::abs(u) < 1 ? 0.25 * (1 + std::cos(3.141592653589793 * u)) : 0;
  };
  for (int i = 0; i <= 300; ++i) {
    ProfileSample sample;
    sample.position = kStep_mm * i;
    const double relative =
        1 - missing_mm * bump(sample.position, 11) + left_over_mm * bump(sample.position, 20.5);
    sample.area = {kArea_mm2 * relative * (1 + drift_per_mm * (sample.position - 15)), kSigma};
    profile.samples.push_back(sample);
  }
  return profile;
}

std::vector<LineSurplus> Measure(const std::vector<LineProfile>& profiles) {
  return MeasureSurplus(profiles, Reading::kArea, Plan());
}

// Trapezoids of a smooth bump that ends on samples: off by the step's fourth power over the bump's.
constexpr double kExact_mm = 1e-4;

TEST(Surplus, IsTheSurplusWithTheSignOfTooLittlePressureAdvance) {
  const auto surplus = Measure({Line(0.8, 0.5), Line(-0.3, -0.2), Line(0, 0)});
  EXPECT_NEAR(surplus[0].acceleration.value, 0.8, kExact_mm);
  EXPECT_NEAR(surplus[0].deceleration.value, 0.5, kExact_mm);
  EXPECT_NEAR(surplus[1].acceleration.value, -0.3, kExact_mm);
  EXPECT_NEAR(surplus[1].deceleration.value, -0.2, kExact_mm);
  EXPECT_NEAR(surplus[2].acceleration.value, 0, kExact_mm);
  EXPECT_NEAR(surplus[2].deceleration.value, 0, kExact_mm);
}

TEST(Surplus, TakesADriftThatAllLinesShareForNoTransition) {
  constexpr double kDrift_per_mm = 0.002;  // 6 % over the line
  std::vector<LineProfile> lines;
  for (const double missing_mm : {0.8, 0.4, 0.0, -0.4}) {
    lines.push_back(Line(missing_mm, missing_mm / 2, kDrift_per_mm));
  }
  const auto surplus = Measure(lines);
  for (std::size_t i = 0; i < lines.size(); ++i) {
    const double missing_mm = 0.8 - 0.4 * static_cast<double>(i);
    // The drift multiplies the bump, too: 0.2 % per mm over the 4 mm from the middle.
    EXPECT_NEAR(surplus[i].acceleration.value, missing_mm, 0.01) << i;
    EXPECT_NEAR(surplus[i].deceleration.value, missing_mm / 2, 0.01) << i;
  }
}

TEST(Surplus, BridgesWhatTheEyeDidNotReadAndIgnoresWhatStandsThere) {
  std::vector<LineProfile> lines = {Line(0.8, 0.5), Line(0, 0)};
  const auto whole = Measure(lines);
  for (std::size_t i = 105; i < 110; ++i) {  // half a millimetre of the bump
    lines[0].samples[i].area = {1e6, 0};
    lines[0].samples[i].gap = true;
  }
  const auto bridged = Measure(lines);
  ASSERT_EQ(bridged[0].unusable, "");
  // A straight bridge over 0.6 mm of a bump 4 mm wide: its sagitta is h^2 / 8 of the curvature
  // 0.8 * 0.25 * (pi / 2)^2 = 0.5 per mm^2, two thirds of it over the gap.
  constexpr double kSagitta_mm = 0.6 * 2 / 3.0 * 0.6 * 0.6 / 8 * 0.5;
  EXPECT_NEAR(bridged[0].acceleration.value, whole[0].acceleration.value, kSagitta_mm);
  EXPECT_EQ(bridged[0].deceleration.value, whole[0].deceleration.value);
}

TEST(Surplus, IsNotMeasuredWhereAQuarterOfAWindowIsUnread) {
  std::vector<LineProfile> lines = {Line(0.8, 0.5), Line(0, 0)};
  for (std::size_t i = 90; i < 120; ++i) lines[0].samples[i].gap = true;  // 3 of 10 mm
  const auto surplus = Measure(lines);
  EXPECT_THAT(surplus[0].unusable, HasSubstr("could not be read"));
  EXPECT_EQ(surplus[1].unusable, "");
}

TEST(Surplus, TakesABridgeAcrossABeadLargerThanThePictureForTheLeastOfIt) {
  const std::vector<LineProfile> whole = {Line(0.8, 0.5), Line(0, 0)};
  std::vector<LineProfile> gap = whole;
  for (std::size_t i = 105; i < 110; ++i) gap[0].samples[i].gap = true;
  std::vector<LineProfile> cut_off = gap;
  for (std::size_t i = 105; i < 110; ++i) cut_off[0].samples[i].cut_off = true;
  const LineSurplus bridged = Measure(gap)[0];
  const LineSurplus least = Measure(cut_off)[0];
  ASSERT_EQ(least.unusable, "");
  EXPECT_EQ(least.acceleration.value, bridged.acceleration.value);
  // 0.6 mm of a bump that is 0.4 deep in its middle and at least three quarters of that here.
  EXPECT_GT(least.acceleration.sigma, 0.6 * 0.3);
  EXPECT_LT(least.acceleration.sigma, 0.6 * 0.4);
  EXPECT_LT(bridged.acceleration.sigma, 0.05);
  EXPECT_EQ(least.deceleration.sigma, bridged.deceleration.sigma);
}

TEST(Surplus, StatesTheScatterThatNoiseMakes) {
  constexpr int kRepeats = 400;
  std::vector<double> pulls;
  Random random(3);
  for (int repeat = 0; repeat < kRepeats; ++repeat) {
    std::vector<LineProfile> lines;
    for (int i = 0; i < 4; ++i) {
      lines.push_back(Line(0.5, 0.3));
      for (ProfileSample& sample : lines.back().samples) {
        sample.area.value += kSigma * random.Normal();
      }
    }
    const auto surplus = Measure(lines);
    pulls.push_back((surplus[0].acceleration.value - 0.5) / surplus[0].acceleration.sigma);
  }
  // Known to 1 / sqrt(800) = 3.5 %. The reference counts only every second reading, since real
  // readings share flow noise: with independent ones its part of the sigma is 1.4 times too wide.
  EXPECT_GT(StandardDeviation(pulls), 0.65) << "seed 3";
  EXPECT_LT(StandardDeviation(pulls), 1.1) << "seed 3";
  EXPECT_NEAR(Mean(pulls), 0, 4 / std::sqrt(static_cast<double>(kRepeats))) << "seed 3";
}

TEST(Surplus, ALineThatShowsOneTransitionIsReadThere) {
  std::vector<LineProfile> lines{Line(0.8, 0.5), Line(0.8, 0.5), Line(0.8, 0.5)};
  std::erase_if(lines[1].samples, [](const ProfileSample& sample) { return sample.position < 15; });
  EXPECT_THAT(Measure(lines)[1].unusable, HasSubstr("could not be read in one piece"));
  lines[1].shows_acceleration = false;
  const auto surplus = Measure(lines);
  EXPECT_EQ(surplus[1].unusable, "");
  EXPECT_FALSE(surplus[1].acceleration.seen);
  EXPECT_TRUE(surplus[1].deceleration.seen);
  EXPECT_NEAR(surplus[1].deceleration.value, 0.5, kExact_mm);
}

// The photo ends in the bump of one line; the others show how such a bump goes on.
TEST(Surplus, ALineThatLeavesThePictureInATransitionIsCompletedByTheOthers) {
  std::vector<LineProfile> lines;
  for (const double left_over_mm : {-0.4, -0.2, 0.0, 0.2, 0.4, 0.6, 0.3}) {
    lines.push_back(Line(left_over_mm, left_over_mm));
  }
  constexpr double kCut_mm = 20.9;  // 0.7 of the bump
  const auto cut = [&](LineProfile& line) {
    std::erase_if(line.samples, [&](const ProfileSample& s) { return s.position > kCut_mm; });
    line.shown = {-1, kCut_mm};
  };
  cut(lines.back());
  const auto surplus = Measure(lines);
  EXPECT_EQ(surplus.back().unusable, "");
  EXPECT_TRUE(surplus.back().deceleration.seen);
  constexpr double kLevel_mm = 0.01;  // for a level without one of its two stretches
  EXPECT_NEAR(surplus.back().deceleration.value, 0.3, kLevel_mm);
  EXPECT_NEAR(surplus.back().acceleration.value, 0.3, kLevel_mm);
  for (LineProfile& line : lines) cut(line);
  EXPECT_FALSE(Measure(lines).back().deceleration.seen);
  EXPECT_TRUE(Measure(lines).back().acceleration.seen);
}

// Three readings of 5 % determine the level to 4 % (half of neighbours count), and a window of 10
// mm errs by 0.4 mm; lines with equal flow determine it together.
TEST(Surplus, LevelsOfFewReadingsAreDrawnTowardsTheOtherLines) {
  constexpr double kNoise = 0.05;
  constexpr int kLines = 12;
  Random random(7);
  TransitionPlan plan = Plan();
  plan.reference = {{6.65, 6.75}, {28.85, 29.05}};
  std::vector<LineProfile> profiles;
  for (int i = 0; i < kLines; ++i) {
    profiles.push_back(Line(0, 0));
    for (ProfileSample& sample : profiles.back().samples) {
      const bool slow = sample.position < 6.8 || sample.position > 28.8;
      if (slow) sample.area.value *= 1 + kNoise * random.Normal();
    }
  }
  const auto scatter_mm = [&] {
    std::vector<double> missing_mm;
    for (const LineSurplus& line : MeasureSurplus(profiles, Reading::kArea, plan)) {
      EXPECT_TRUE(line.unusable.empty()) << line.unusable;
      missing_mm.push_back(line.acceleration.value);
    }
    return StandardDeviation(missing_mm);
  };
  const double pooled_mm = scatter_mm();
  EXPECT_LT(pooled_mm, 0.2);
  plan.steady_middle = true;  // has readings enough: each line by itself
  EXPECT_GT(scatter_mm(), 1.5 * pooled_mm);
}

TEST(Surplus, ALineThatClearlyFlowsOtherwiseKeepsItsOwnLevel) {
  std::vector<LineProfile> profiles;
  for (int i = 0; i < 8; ++i) profiles.push_back(Line(0, 0));
  for (ProfileSample& sample : profiles[3].samples) sample.area.value *= 1.2;
  const auto surplus = Measure(profiles);
  EXPECT_NEAR(surplus[3].acceleration.value, 0, kExact_mm);
  EXPECT_NEAR(surplus[3].deceleration.value, 0, kExact_mm);
}

// Gaps get no emptier than empty: beyond some part the whole grows no further.
TEST(CutWindow, FollowsLinesNearItWhereTheOthersSaturate) {
  std::vector<double> parts, wholes;
  for (int i = 0; i <= 20; ++i) {
    parts.push_back(-0.1 * i);
    wholes.push_back(std::max(-1.2, 1.5 * parts.back()));
  }
  const auto completed = CompleteWindow(parts, wholes, -0.05);
  ASSERT_TRUE(completed.has_value());
  EXPECT_NEAR(completed->value, -0.075, 0.1);  // a straight line through all is 0.3 off
}

TEST(CutWindow, SigmaHoldsTheLinesScatter) {
  constexpr int kRepeats = 2000, kLines = 15;
  constexpr double kScatter = 0.1;
  Random random(1);
  std::vector<double> pulls;
  for (int repeat = 0; repeat < kRepeats; ++repeat) {
    std::vector<double> parts, wholes;
    for (int i = 0; i < kLines; ++i) {
      parts.push_back(-0.1 * i);
      wholes.push_back(1.5 * parts.back() + kScatter * random.Normal());
    }
    const double part = random.Uniform(-0.7, 0.1);
    const double truth = 1.5 * part + kScatter * random.Normal();
    const auto completed = CompleteWindow(parts, wholes, part);
    ASSERT_TRUE(completed.has_value());
    pulls.push_back((completed->value - truth) / completed->sigma);
  }
  EXPECT_NEAR(Mean(pulls), 0, 4 / std::sqrt(static_cast<double>(kRepeats))) << "seed 1";
  // Few weighted lines tell their own scatter badly: Student's t, not the normal distribution.
  EXPECT_GT(RobustStandardDeviation(pulls), 0.9) << "seed 1";
  EXPECT_LT(RobustStandardDeviation(pulls), 1.2) << "seed 1";
}

}  // namespace
}  // namespace trammel::pressure_advance
