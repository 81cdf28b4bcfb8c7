// The contact method where more than noise acts: its intervals hold, or it refuses.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdio>

#include "tap/analyse/analyse.h"
#include "tap/contact/press_test_support.h"

namespace trammel::tap {
namespace {

struct Answers {
  int good = 0;
  int covered = 0;
  double half_width_um = 0;
  double least_half_width_um = 1e9;
};

Answers Ask(const test::PressWorld& world, const TapOptions& options = {.latency_s = 0}) {
  constexpr int kTaps = 600;
  constexpr std::uint64_t kFirstSeed = 1000;
  TapAnalyser analyser(options);
  Answers answers;
  for (std::uint64_t i = 0; i < kTaps; ++i) {
    const test::PressTap tap = MakePressTap(world, kFirstSeed + i);
    const TapAnalysis analysis = analyser.Analyse(tap.View());
    if (analysis.verdict != Verdict::kGood) {
      continue;
    }
    const Interval& interval = analysis.interval95_mm;
    ++answers.good;
    answers.covered += interval.lo <= tap.contact_z_mm && tap.contact_z_mm <= interval.hi ? 1 : 0;
    const double half_width_um = 500 * (interval.hi - interval.lo);
    answers.half_width_um += half_width_um;
    answers.least_half_width_um = std::min(answers.least_half_width_um, half_width_um);
  }
  answers.half_width_um /= answers.good;
  std::printf("    good %d of %d, covered %.1f %%, half-width %.2f um\n", answers.good, kTaps,
              100.0 * answers.covered / answers.good, answers.half_width_um);
  return answers;
}

// 95 % less 3 standard deviations of a share of 600.
constexpr double kLeastCovered = 0.923;

TEST(TapContact, IntervalsHoldWhereAForceGoesJustAfterTheBreak) {
  for (const double slip_g : {1.0, 2.0, 5.0}) {
    for (const double slip_mm : {0.0, 0.002}) {
      const Answers answers = Ask({.slip_g = slip_g, .slip_mm = slip_mm});
      EXPECT_GE(answers.covered, kLeastCovered * answers.good) << slip_g << " gf, " << slip_mm;
      EXPECT_LE(answers.half_width_um, 1.5 * (1 + slip_g / 3.5)) << slip_g << " gf, " << slip_mm;
    }
  }
}

TEST(TapContact, IntervalsHoldWhereTheStructureRingsOnceDuringThePress) {
  // Whichever way it swings at the break, by twice the noise and more: what it bends there looks
  // like another form of press.
  for (const double hz : {6.0, 8.0, 10.0}) {
    for (const double ring_g : {-6.0, -4.0, 4.0, 6.0}) {
      const Answers answers = Ask({.ring_g = ring_g, .ring_hz = hz});
      EXPECT_GE(answers.covered, kLeastCovered * answers.good) << ring_g << " gf";
    }
  }
}

TEST(TapContact, IntervalsHoldWhereAQuietConverterAverages) {
  for (const double rate_hz : {80.0, 320.0}) {
    for (const int averages : {1, 2, 4}) {
      const Answers answers = Ask({.noise_g = 0.1, .rate_hz = rate_hz, .averages = averages});
      EXPECT_GE(answers.covered, kLeastCovered * answers.good) << rate_hz << "/s, " << averages;
      // A quarter of the way from sample to sample; half of it where averaging takes as many
      // samples as a narrow soft zone has, which looks like it.
      const double of_way = averages > 3 ? 0.5 : 0.25;
      EXPECT_LE(answers.half_width_um, of_way * 320 / rate_hz) << rate_hz << "/s, " << averages;
    }
  }
}

TEST(TapContact, IntervalsHoldWhereBacklashHidesTheLatency) {
  for (const double backlash_mm : {0.002, 0.006}) {
    for (const double latency_s : {0.0, 0.008}) {
      const Answers answers = Ask({.latency_s = latency_s, .backlash_mm = backlash_mm}, {});
      EXPECT_GE(answers.covered, kLeastCovered * answers.good) << backlash_mm << ", " << latency_s;
      EXPECT_LE(answers.half_width_um, 2) << backlash_mm << ", " << latency_s;
    }
  }
}

TEST(TapContact, PlayOfADriveIsNotTakenForALatency) {
  // On the way down it looks like one: the touch comes later by the play over the speed.
  for (const double backlash_mm : {0.02, 0.05}) {
    for (const double latency_s : {0.0, 0.006}) {
      for (const double noise_g : {0.5, 2.0}) {
        const Answers answers = Ask({.depth_mm = 0.035 + backlash_mm,
                                     .noise_g = noise_g,
                                     .pull_back_mm = 0.2,
                                     .latency_s = latency_s,
                                     .backlash_mm = backlash_mm},
                                    {});
        EXPECT_GE(answers.covered, kLeastCovered * answers.good)
            << backlash_mm << ", " << latency_s;
        EXPECT_LE(answers.half_width_um, 3) << backlash_mm << ", " << latency_s;
      }
    }
  }
}

TEST(TapContact, IntervalsHoldWhereFrictionOfTheDriveFadesAlongThePress) {
  for (const double fade_mm : {0.004, 0.007}) {
    const Answers answers =
        Ask({.noise_g = 0.3, .onset_lag_mm = fade_mm, .onset_fade_mm = fade_mm});
    EXPECT_GE(answers.covered, kLeastCovered * answers.good) << fade_mm;
    EXPECT_LE(answers.half_width_um, 1) << fade_mm;
  }
}

TEST(TapContact, IntervalsHoldWhereNoFormOfThePressIsTheTrueOne) {
  for (const double power : {0.7, 0.8}) {
    const Answers yielding = Ask({.law = [power](double u) { return std::pow(u, power); }});
    EXPECT_GE(yielding.covered, kLeastCovered * yielding.good) << power;
    EXPECT_LE(yielding.half_width_um, 1) << power;
  }
}

TEST(TapContact, IntervalsHoldWhereAFaintToeStiffensAfterAWhile) {
  // A tenth of the stiffness over 2 um, all of it from 12 um on.
  const auto law = [](double u) {
    const double d = 45 * u;
    const double x = std::clamp((d - 2) / 10, 0.0, 1.0);
    const double grown = 10 * x * x * x * (1 - 0.5 * x) + std::max(0.0, d - 12);
    return (0.1 * d + 0.9 * grown) / 45;
  };
  const Answers answers = Ask({.law = law, .noise_g = 0.5});
  EXPECT_GE(answers.good, 300);
  EXPECT_GE(answers.covered, kLeastCovered * answers.good);
}

TEST(TapContact, NoIntervalCollapsesWhereSamplesAreWildOrHeld) {
  // A fifth of what clean taps have.
  constexpr double kLeast_um_per_g = 0.1;
  for (const double share : {0.01, 0.05, 0.1}) {
    for (const double noise_g : {0.5, 2.0}) {
      const Answers held = Ask({.noise_g = noise_g, .held_share = share});
      EXPECT_GE(held.least_half_width_um, kLeast_um_per_g * noise_g)
          << share << " held, " << noise_g << " gf";
      const Answers wild = Ask({.noise_g = noise_g, .outlier_share = share});
      EXPECT_GE(wild.least_half_width_um, kLeast_um_per_g * noise_g)
          << share << " wild, " << noise_g << " gf";
    }
  }
}

}  // namespace
}  // namespace trammel::tap
