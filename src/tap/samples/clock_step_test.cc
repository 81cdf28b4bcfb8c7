#include "tap/samples/clock_step.h"

#include <gtest/gtest.h>

#include <cmath>
#include <random>
#include <vector>

#include "tap/samples/finding.h"
#include "tap/samples/lines_test_support.h"

namespace trammel::tap {
namespace {

constexpr double kPeriod_s = 1.0 / 320;

// Even times with delays of a range, in parts of a period.
std::vector<float> Times(std::size_t count, double range, std::mt19937_64& random) {
  std::uniform_real_distribution<double> delay(-0.5 * range, 0.5 * range);
  std::vector<float> times;
  for (std::size_t i = 0; i < count; ++i) {
    times.push_back(static_cast<float>(kPeriod_s * (static_cast<double>(i) - 150 + delay(random))));
  }
  return times;
}

double Total(const ClockSteps& steps) { return steps.forward_s + steps.backward_s; }

TEST(ClockStep, IsTakenOutWhereverItComes) {
  std::mt19937_64 random(1);
  for (const double step_s : {-0.7e-3, -0.6e-3, 0.6e-3, 1e-3, 1.8e-3, 5e-3, 20e-3}) {
    for (const std::size_t at : {5, 77, 295}) {
      std::vector<float> times = Times(300, 0.05, random);
      const std::vector<float> even = times;
      for (std::size_t i = at; i < times.size(); ++i) times[i] += static_cast<float>(step_s);
      const ClockSteps steps = TakeOutClockSteps(times, kPeriod_s);
      // Means of four and more delays of 5 % of a period.
      const double tolerance_s = 0.05 * kPeriod_s;
      EXPECT_NEAR(steps.forward_s - steps.backward_s, step_s, tolerance_s) << "at " << at;
      EXPECT_NEAR(Total(steps), std::abs(step_s), tolerance_s) << "at " << at;
      for (std::size_t i = 0; i < times.size(); ++i) {
        EXPECT_NEAR(times[i], even[i], tolerance_s) << step_s << " s at " << at << ", sample " << i;
      }
    }
  }
}

TEST(ClockStep, IsNotSeenInLostRepeatedLateOrScatteredSamples) {
  std::mt19937_64 random(2);
  for (int trial = 0; trial < 300; ++trial) {
    for (const double range : {0.0, 0.1, 0.3, 0.6, 1.0}) {
      std::vector<float> times;
      for (const float time_s : Times(300, range, random)) {
        if (random() % 10 == 0) continue;  // lost
        times.push_back(time_s);
        if (random() % 20 == 0) times.push_back(time_s);  // repeated
      }
      times[40] += static_cast<float>(0.4 * kPeriod_s);  // late
      const std::vector<float> given = times;
      EXPECT_EQ(Total(TakeOutClockSteps(times, kPeriod_s)), 0) << range << ", trial " << trial;
      EXPECT_EQ(times, given);
    }
  }
}

TEST(ClockStep, BearsAnyTimes) {
  for (const double period_s : {0.0, std::nan(""), kPeriod_s}) {
    for (std::size_t count : {0, 1, 2, 9}) {
      std::vector<float> times(count, 1.0F);
      EXPECT_EQ(Total(TakeOutClockSteps(times, period_s)), 0);
    }
  }
}

RecordedTap WithStep(std::uint64_t seed, double after_pull_back_s, double step_s) {
  RecordedTap tap = Record({}, seed);
  const double from_s = tap.moves[3].start_time_s + after_pull_back_s;
  for (double& time_s : tap.drawn.time_s) {
    time_s += time_s >= from_s ? step_s : 0;
  }
  return tap;
}

TEST(ClockStep, IsRefusedByNameWhereItMovesTheBreakByMicrons) {
  for (const double step_s : {4e-3, 5e-3, 20e-3}) {
    for (const double at_s : {0.03, 0.1, 0.2}) {
      const TapAnalysis analysis = TapAnalyser({}).Analyse(WithStep(3, at_s, step_s).View());
      EXPECT_EQ(analysis.verdict, Verdict::kRefused);
      EXPECT_EQ(Name(analysis.reason.code), "clock_step") << step_s << " s at " << at_s;
    }
  }
}

// Compares with the truth on either clock: as is, and as if the later clock were the moves'.
TEST(ClockStep, LeavesBothReadingsInTheIntervalWhereItIsSmall) {
  constexpr int kTaps = 200;
  constexpr double kSpeed_mm_s = 0.32;
  for (const double step_s : {-0.8e-3, 1e-3, 2.2e-3}) {
    int both = 0;
    for (std::uint64_t seed = 0; seed < kTaps; ++seed) {
      const RecordedTap tap = WithStep(seed, 0.07, step_s);
      const TapAnalysis analysis = TapAnalyser({.latency_s = 0}).Analyse(tap.View());
      ASSERT_EQ(analysis.verdict, Verdict::kGood) << Explain(analysis.reason);
      EXPECT_TRUE(HasNotice(analysis, FindingCode::kClockStep)) << step_s;
      const Interval& interval = analysis.contact_mm.interval95;
      const double early_mm = tap.drawn.contact_z_mm + std::min(0.0, kSpeed_mm_s * step_s);
      const double late_mm = tap.drawn.contact_z_mm + std::max(0.0, kSpeed_mm_s * step_s);
      both += interval.lo <= early_mm && late_mm <= interval.hi;
    }
    EXPECT_GE(both, 183) << step_s;  // 95 % of 200, less 2.3 standard deviations
  }
}

}  // namespace
}  // namespace trammel::tap
