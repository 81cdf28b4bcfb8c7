#include "tap/tuning.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>

#include "base/random.h"
#include "base/statistics.h"

namespace trammel::tap {
namespace {

constexpr double kStiffness_g_mm = 3500;
constexpr double kNoise_g = 8;
constexpr double kPress_mm = 0.045;

/// A tap of which the moves, the approach and what was found in it are said; its pull-back's
/// samples are not looked at.
struct World {
  double speed_mm_s = 0.32;
  double rate_hz = 320;
  double drift_g_s = 2;
  double way_mm = 0.1;
  std::vector<double> time_s, force_g;
  std::vector<Move> moves;
  TapAnalysis analysis;

  void Make(Random& random) {
    moves = {{0, 1, 2, 0, 2, -1},
             {1, 0, 0, 0, -kPress_mm, 0},
             {1.1, speed_mm_s / 350, 0, 350, -kPress_mm, 1},
             {1.1 + speed_mm_s / 350, way_mm / speed_mm_s, speed_mm_s, 0, -kPress_mm, 1}};
    for (double t = 0; t < 1.1 + way_mm / speed_mm_s + 0.2; t += 1 / rate_hz) {
      time_s.push_back(t);
      force_g.push_back(drift_g_s * t + kNoise_g * random.Normal());
    }
    analysis.verdict = Verdict::kGood;
    analysis.contact_z_mm = 0;
    analysis.standard_uncertainty_mm = 0.0012;
    analysis.noise_g = kNoise_g;
    analysis.force.fitted = true;
    analysis.force.break_z_mm = 0;
    analysis.force.press_g = {kStiffness_g_mm, 0, 0, 0};
  }
  [[nodiscard]] TuningTap Tap() const { return {{time_s, force_g, moves}, &analysis}; }
};

Advice Find(const Tuning& tuning, const char* what) {
  for (const Advice& advice : tuning.advice) {
    if (advice.what == what) return advice;
  }
  ADD_FAILURE() << what;
  return {};
}

TEST(Tuning, ReadsTheTraitsOfTheTaps) {
  Random random(1);
  World world;
  world.Make(random);
  const auto tuning = Tune(std::vector{world.Tap()});
  ASSERT_TRUE(tuning);
  const TapTraits& traits = tuning->traits;
  EXPECT_EQ(traits.taps, 1u);
  EXPECT_NEAR(traits.sample_rate_hz, 320, 0.1);
  EXPECT_NEAR(traits.stiffness_g_mm, kStiffness_g_mm, 0.01 * kStiffness_g_mm);
  EXPECT_NEAR(traits.press_depth_mm, kPress_mm, 1e-9);
  EXPECT_NEAR(traits.approach_noise_g, kNoise_g, 1.5);  // 288 samples: 4 %, MAD 7 %, two and a half
  EXPECT_NEAR(traits.drift_g_s, world.drift_g_s, 8);    // 8 gf over 0.9 s: 1.8 gf/s, four times
}

TEST(Tuning, PredictsTheBoundThatIsKnownForACurvedPress) {
  // docs/tap.md: 1.14 um at 8 gf, 3500 gf/mm, 1 um per sample, 45 um press, 55 um after it. The
  // formula is that of a break whose place is not known beforehand to be the line's end.
  TapTraits traits;
  traits.noise_g = kNoise_g;
  traits.stiffness_g_mm = kStiffness_g_mm;
  traits.sample_rate_hz = 320;
  EXPECT_NEAR(BreakUncertainty(traits, 0.32, 0.045, 0.055), 1.14e-3, 0.1e-3);
}

TEST(Tuning, TheFormulaIsTheScatterOfFittedBreaks) {
  // A parabola through the press and a line through the rest, where they meet; 1000 virtual
  // presses.
  constexpr int kSamples = 45;
  constexpr int kAfter = 55;
  Random random(5);
  std::vector<double> breaks;
  for (int run = 0; run < 1000; ++run) {
    // Normal equations of f = a d + b d^2 + c with the break's slope known: the intercept's error
    // over the stiffness is the break's.
    double s[3][4] = {};
    for (int i = 0; i < kSamples; ++i) {
      const double d = (i + 0.5) * 0.001;
      const double f = kStiffness_g_mm * d + kNoise_g * random.Normal();
      const double x[3] = {1, d, d * d};
      for (int r = 0; r < 3; ++r) {
        for (int c = 0; c < 3; ++c) s[r][c] += x[r] * x[c];
        s[r][3] += x[r] * f;
      }
    }
    for (int p = 0; p < 3; ++p) {
      for (int r = 0; r < 3; ++r) {
        if (r == p) continue;
        const double factor = s[r][p] / s[p][p];
        for (int c = 0; c < 4; ++c) s[r][c] -= factor * s[p][c];
      }
    }
    const double press_at_break = s[0][3] / s[0][0];
    double sum = 0, sum_t = 0, tt = 0, tf = 0;
    std::vector<double> rest;
    for (int i = 0; i < kAfter; ++i) {
      rest.push_back(kNoise_g * random.Normal());
      sum += rest.back() / kAfter;
      sum_t += (i + 0.5) / kAfter;
    }
    for (int i = 0; i < kAfter; ++i) {
      const double t = i + 0.5 - sum_t;
      tt += t * t;
      tf += t * (rest[static_cast<std::size_t>(i)] - sum);
    }
    const double line_at_break = sum - tf / tt * sum_t;
    breaks.push_back((press_at_break - line_at_break) / kStiffness_g_mm);
  }
  TapTraits traits;
  traits.noise_g = kNoise_g;
  traits.stiffness_g_mm = kStiffness_g_mm;
  traits.sample_rate_hz = 1000;
  const double predicted = BreakUncertainty(traits, 1, 0.045, 0.055);
  // 1000 runs know a standard deviation to 2.2 %; the formula is that of many samples (1/45: 2 %).
  EXPECT_NEAR(StandardDeviation(breaks), predicted, 0.1 * predicted);
}

TEST(Tuning, AdvisesASlowerPullBackWhereNoiseAsksForIt) {
  Random random(2);
  World world;
  world.speed_mm_s = 2;
  world.Make(random);
  const auto tuning = Tune(std::vector{world.Tap()}, {.wanted_uncertainty_mm = 0.001});
  ASSERT_TRUE(tuning);
  const Advice speed = Find(*tuning, "pull-back speed");
  EXPECT_TRUE(speed.change);
  EXPECT_LT(speed.advised, 0.4);
  // At the advised speed and distance the formula gives what was wanted.
  EXPECT_LE(BreakUncertainty(tuning->traits, speed.advised, kPress_mm, 2 * kPress_mm), 0.00101);
  EXPECT_THAT(speed.because, testing::HasSubstr("8.00 gf"));
}

TEST(Tuning, KeepsWhatIsGoodEnough) {
  Random random(3);
  World world;
  world.way_mm = 3 * kPress_mm;
  world.Make(random);
  const auto tuning = Tune(std::vector{world.Tap()});
  ASSERT_TRUE(tuning);
  EXPECT_FALSE(Find(*tuning, "pull-back distance").change);
}

TEST(Tuning, TheDriftFilterLiesBetweenDriftAndCollision) {
  Random random(4);
  World world;
  world.drift_g_s = 30;
  world.Make(random);
  const auto tuning = Tune(std::vector{world.Tap()});
  ASSERT_TRUE(tuning);
  const Advice filter = Find(*tuning, "drift filter");
  const double rise_s = kPress_mm / 2;
  EXPECT_GT(filter.advised, 30 / (0.1 * kPress_mm * kStiffness_g_mm) / 6.283 / 1.5);
  EXPECT_LT(filter.advised, 0.1 / rise_s / 6.283);
}

TEST(Tuning, SaysNothingWithoutAGoodTap) {
  EXPECT_FALSE(Tune({}));
  const TapAnalysis refused;
  EXPECT_FALSE(Tune(std::vector{TuningTap{{}, &refused}}));
}

}  // namespace
}  // namespace trammel::tap
