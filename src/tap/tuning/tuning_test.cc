#include "tap/tuning/tuning.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>

#include "base/random.h"
#include "base/statistics.h"
#include "tap/tuning/tuning_test_support.h"

namespace trammel::tap {
namespace {

using test_support::TapDrawing;
using ::testing::HasSubstr;

constexpr double kStiffness_g_mm = 3500;
constexpr double kNoise_g = 8;
constexpr int kRecorded = 10;
constexpr int kFollowed = 100;

/// A printer as somebody may have set it up.
DrawnPrinter DrawPrinter(std::uint64_t seed) {
  Random random(seed);
  const auto log_uniform = [&](double lo, double hi) {
    return lo * std::pow(hi / lo, random.Uniform());
  };
  DrawnPrinter printer;
  TapDrawing& drawing = printer.drawing;
  drawing.rate_hz = log_uniform(80, 2000);
  drawing.noise_g = log_uniform(0.1, 8);
  drawing.stiffness_g_mm = log_uniform(1500, 9000);
  drawing.depth_mm = random.Uniform(60, 250) / drawing.stiffness_g_mm;
  drawing.curvature = random.Uniform(-0.1, 0.4);
  drawing.pull_back_mm_s = log_uniform(0.1, 1);
  drawing.pull_back_mm = std::max(0.08, drawing.depth_mm * random.Uniform(2, 6));
  drawing.drift_g_s = random.Uniform(-5, 5);
  drawing.approach_mm_s = random.Uniform(1, 3);
  drawing.relaxed = random.Uniform(0, 0.1);
  if (random.Uniform() < 0.3) drawing.hum_g = drawing.noise_g * random.Uniform(0, 1);
  printer.halt_scatter_mm =
      std::min(0.5 * drawing.approach_mm_s / drawing.rate_hz, 0.3 * drawing.depth_mm);
  return printer;
}

Tuning TuneOf(const DrawnPrinter& printer, std::uint64_t seed, const TuningOptions& options = {}) {
  const auto recorded = Record(printer, kRecorded, seed);
  return Tune(TuningTaps(recorded), options);
}

TEST(Tuning, ReadsTheTraitsOfTheTaps) {
  DrawnPrinter printer;
  printer.drawing.noise_g = kNoise_g;
  printer.drawing.drift_g_s = 2;
  const Tuning tuning = TuneOf(printer, 1);
  const TapTraits& traits = tuning.traits;
  EXPECT_EQ(traits.taps, 10u);
  EXPECT_NEAR(traits.sample_rate_hz, 320, 0.1);
  EXPECT_NEAR(traits.stiffness_g_mm, kStiffness_g_mm, 0.1 * kStiffness_g_mm);
  EXPECT_NEAR(traits.press_depth_mm, 0.045, 0.002);
  EXPECT_NEAR(traits.noise_g, kNoise_g, 0.8);  // 3000 samples: 1.3 %
  EXPECT_NEAR(traits.approach_noise_g, kNoise_g, 1);
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

TEST(Tuning, TapsUnderItsAdviceAreGoodAndNoLessCertain) {
  constexpr double kGood = 0.95;
  // Medians of 100 uncertainties scatter by 8 %, two of them; the press is read through noise.
  constexpr double kWorse = 1.15;
  int changed = 0;
  int followed = 0;
  int good = 0;
  for (std::uint64_t seed = 3000; seed < 3040; ++seed) {
    const DrawnPrinter printer = DrawPrinter(seed);
    const Tuning tuning = TuneOf(printer, 10 * seed);
    if (tuning.end != TuningEnd::kChange) continue;
    ++changed;
    const DrawnOutcome present = OutcomeOf(Record(printer, kFollowed, 10 * seed + 1));
    const DrawnOutcome advised =
        OutcomeOf(Record(Follow(printer, tuning), kFollowed, 10 * seed + 1));
    followed += kFollowed;
    good += advised.good;
    EXPECT_GE(advised.good, 0.88 * kFollowed) << seed << ": " << tuning.because;
    if (present.good > 0.25 * kFollowed) {
      EXPECT_LT(advised.uncertainty_mm, kWorse * present.uncertainty_mm) << seed;
    }
    EXPECT_GE(advised.good, present.good - 0.05 * kFollowed) << seed;
  }
  EXPECT_GE(changed, 6);
  EXPECT_GE(good, kGood * followed);
}

TEST(Tuning, AdvisesASlowerPullBackWhereNoiseAsksForIt) {
  DrawnPrinter printer;
  printer.drawing.noise_g = kNoise_g;
  printer.drawing.pull_back_mm_s = 1;
  const Tuning tuning = TuneOf(printer, 2);
  ASSERT_EQ(tuning.end, TuningEnd::kChange) << tuning.because;
  EXPECT_LT(Find(tuning, "pull-back speed").advised, 0.5);
  ASSERT_TRUE(tuning.trial_present && tuning.trial_advised);
  EXPECT_GE(tuning.trial_advised->ShownShare(), 0.95);
  EXPECT_LT(tuning.trial_advised->uncertainty_mm, 0.8 * tuning.trial_present->uncertainty_mm);
  EXPECT_EQ(tuning.tried > 0, true);
}

TEST(Tuning, KeepsWhatIsGoodEnough) {
  const Tuning tuning = TuneOf({}, 3);
  EXPECT_EQ(tuning.end, TuningEnd::kKeep);
  EXPECT_THAT(tuning.because, HasSubstr("keep the settings"));
  EXPECT_THAT(tuning.because, HasSubstr("95 %: within "));
  EXPECT_FALSE(tuning.trial_advised);
  for (const Advice& advice : tuning.advice) EXPECT_FALSE(advice.change) << advice.what;
}

TEST(Tuning, MakesAShallowPressDeeper) {
  DrawnPrinter printer;
  printer.drawing.depth_mm = 0.014;
  printer.drawing.pull_back_mm = 0.1;
  const Tuning tuning = TuneOf(printer, 4);
  ASSERT_EQ(tuning.end, TuningEnd::kChange) << tuning.because;
  EXPECT_GT(Find(tuning, "press force").advised, 70);
  const DrawnOutcome advised = OutcomeOf(Record(Follow(printer, tuning), kFollowed, 5));
  EXPECT_EQ(advised.good, kFollowed);
  EXPECT_LE(advised.shallow, 0.05 * kFollowed);
}

TEST(Tuning, AdvisesNothingThatMakesAPressShallow) {
  for (std::uint64_t seed = 3100; seed < 3112; ++seed) {
    DrawnPrinter printer = DrawPrinter(seed);
    printer.drawing.noise_g = 0.05;  // far less force would do by noise
    const Tuning tuning = TuneOf(printer, seed);
    const Advice force = Find(tuning, "press force");
    EXPECT_TRUE(tuning.advice.empty() || force.advised >= force.present) << seed;
  }
}

TEST(Tuning, SaysWhenItIsTheMachineThatScatters) {
  DrawnPrinter printer;
  printer.drawing.noise_g = kNoise_g;
  auto recorded = Record(printer, 20, 6);
  Random random(7);
  for (DrawnRecording& tap : recorded) {
    const double off_mm = random.Normal(0, 0.02);
    for (Move& move : tap.moves) move.start_z_mm += off_mm;
    tap.analysis = TapAnalyser({}).Analyse(tap.View());
  }
  const Tuning tuning = Tune(TuningTaps(recorded));
  EXPECT_EQ(tuning.end, TuningEnd::kKeep) << tuning.because;
  EXPECT_EQ(tuning.scatter.cause, ScatterCause::kMachine) << tuning.scatter.because;
  EXPECT_NEAR(tuning.scatter.beyond_mm, 0.02, 0.008);
}

TEST(Tuning, TapsOfSeveralSettingsGetNoAdvice) {
  DrawnPrinter printer;
  auto recorded = Record(printer, 5, 8);
  printer.drawing.pull_back_mm_s = 0.5;
  for (DrawnRecording& tap : Record(printer, 5, 9)) recorded.push_back(std::move(tap));
  const Tuning tuning = Tune(TuningTaps(recorded));
  EXPECT_EQ(tuning.end, TuningEnd::kNone);
  EXPECT_THAT(tuning.because, HasSubstr("pull-back speeds from 0.32 to 0.5 mm/s"));
  EXPECT_TRUE(tuning.advice.empty());
}

TEST(Tuning, WhereTapsFailByDirtItIsNotTheSettings) {
  DrawnPrinter clean;
  DrawnPrinter fouled;
  fouled.drawing.relaxed = 0.95;
  auto recorded = Record(clean, 6, 10);
  for (DrawnRecording& tap : Record(fouled, 6, 11)) recorded.push_back(std::move(tap));
  const Tuning tuning = Tune(TuningTaps(recorded));
  EXPECT_EQ(tuning.recorded_good, 6u);
  EXPECT_EQ(tuning.end, TuningEnd::kNone);
  EXPECT_THAT(tuning.because, HasSubstr("settings alone do not explain it"));
  EXPECT_THAT(tuning.because, HasSubstr("scrub"));
}

TEST(Tuning, AFewLuckyTapsAmongBadOnesGiveNoAdvice) {
  DrawnPrinter pressed;
  pressed.drawing.pull_back_mm = 0.035;
  auto recorded = Record({}, 2, 15);
  for (DrawnRecording& tap : Record(pressed, 10, 16)) recorded.push_back(std::move(tap));
  const Tuning tuning = Tune(TuningTaps(recorded));
  EXPECT_EQ(tuning.end, TuningEnd::kNone);
  EXPECT_THAT(tuning.because, HasSubstr("only 2 of 12 taps are good"));
  EXPECT_THAT(tuning.because, HasSubstr("record again with 0.2 mm"));
}

TEST(Tuning, WithoutAGoodTapItSaysWhyThereIsNone) {
  EXPECT_EQ(Tune({}).end, TuningEnd::kNone);
  EXPECT_THAT(Tune({}).because, HasSubstr("no taps"));
  DrawnPrinter pressed;
  pressed.drawing.pull_back_mm = 0.035;
  const Tuning tuning = TuneOf(pressed, 12);
  EXPECT_EQ(tuning.end, TuningEnd::kNone);
  EXPECT_THAT(tuning.because, HasSubstr("none of 10 taps is good"));
  EXPECT_THAT(tuning.because, HasSubstr("pull back farther"));
  const TapAnalysis refused;
  EXPECT_EQ(Tune(std::vector{TuningTap{{}, &refused}}).end, TuningEnd::kNone);
}

TEST(Tuning, BearsWhateverAPrinterHas) {
  const auto drawn = [](auto&& change) {
    DrawnPrinter printer;
    change(printer.drawing);
    return printer;
  };
  const struct {
    const char* name;
    DrawnPrinter printer;
    int taps;
  } cases[] = {
      {"one tap", drawn([](TapDrawing&) {}), 1},
      {"no noise", drawn([](TapDrawing& d) { d.noise_g = 0; }), 5},
      {"quiet", drawn([](TapDrawing& d) { d.noise_g = 0.05; }), 5},
      {"40 samples/s", drawn([](TapDrawing& d) { d.rate_hz = 40; }), 5},
      {"40 samples/s, slowly",
       drawn([](TapDrawing& d) { d.rate_hz = 40, d.pull_back_mm_s = 0.05; }), 5},
      {"8000 samples/s", drawn([](TapDrawing& d) { d.rate_hz = 8000; }), 3},
      {"a long wait at 8000", drawn([](TapDrawing& d) {
         d.rate_hz = 8000, d.pull_back_mm_s = 0.05, d.pull_back_mm = 0.5;
       }),
       2},
      {"huge hum", drawn([](TapDrawing& d) { d.hum_g = 60; }), 5},
      {"noise as large as the press", drawn([](TapDrawing& d) { d.noise_g = 40; }), 5},
      {"a pull, negative", drawn([](TapDrawing& d) { d.sign = -1, d.tare_g = -300; }), 5},
  };
  for (const auto& c : cases) {
    const auto recorded = Record(c.printer, c.taps, 100);
    const Tuning tuning = Tune(TuningTaps(recorded));
    EXPECT_FALSE(tuning.because.empty()) << c.name;
    EXPECT_EQ(tuning.advice.empty(), tuning.end == TuningEnd::kNone) << c.name;
    EXPECT_EQ(tuning.because.find("nan"), std::string::npos) << c.name << ": " << tuning.because;
    if (tuning.end != TuningEnd::kChange) continue;
    const DrawnOutcome advised = OutcomeOf(Record(Follow(c.printer, tuning), kFollowed, 101));
    EXPECT_GE(advised.good, 0.9 * kFollowed) << c.name << ": " << tuning.because;
  }
}

TEST(Tuning, OneSeedGivesOneAdvice) {
  DrawnPrinter printer;
  printer.drawing.noise_g = kNoise_g;
  const auto recorded = Record(printer, kRecorded, 13);
  const Tuning a = Tune(TuningTaps(recorded));
  const Tuning b = Tune(TuningTaps(recorded));
  EXPECT_EQ(a.because, b.because);
}

TEST(Tuning, TheDriftFilterLiesBetweenDriftAndCollision) {
  DrawnPrinter printer;
  printer.drawing.drift_g_s = 20;
  const Tuning tuning = TuneOf(printer, 14);
  const Advice filter = Find(tuning, "drift filter");
  const double force_g = 0.045 * kStiffness_g_mm;
  const double rise_s = 0.045 / printer.drawing.approach_mm_s;
  EXPECT_GT(filter.advised, 20 / (0.1 * force_g) / 6.283 / 1.5);
  EXPECT_LT(filter.advised, 0.1 / rise_s / 6.283);
}

}  // namespace
}  // namespace trammel::tap
