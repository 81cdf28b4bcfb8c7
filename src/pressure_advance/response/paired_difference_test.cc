#include "pressure_advance/response/paired_difference.h"

#include <gtest/gtest.h>

#include <cmath>

#include "base/random.h"
#include "pressure_advance/response/fit_transitions.h"

namespace trammel::pressure_advance {
namespace {

constexpr double kAnswer_s = 0.036;
constexpr double kSlip_s = 0.003;  // difference at the answer
constexpr double kOwnLag_s = 0.005;
constexpr double kFlow_s = 0.0002;

struct Lines {
  TransitionSeries acceleration, deceleration;
};

// Ten lines of which each has a lag of its own. Of the filament beyond the answer `lost` does not
// show; `early_s` before the answer already.
Lines TenLines(std::uint64_t seed, double slip_s, double lost = 0, double early_s = 0) {
  Random random(seed);
  Lines lines;
  for (int i = 0; i < 10; ++i) {
    const double pa_s = 0.06 * i / 9;
    const double own_s = kAnswer_s - pa_s + kOwnLag_s * random.Normal();
    const double shown = 0.55 + 0.45 * std::pow(pa_s / kAnswer_s, 2);
    const double past_s = std::max(0.0, pa_s - kAnswer_s + early_s);
    for (TransitionSeries* series : {&lines.acceleration, &lines.deceleration}) {
      const bool rises = series == &lines.acceleration;
      series->pa_s.push_back(pa_s);
      series->excess_s.push_back(own_s + (rises ? 0.7 : -0.3) * slip_s * shown +
                                 (rises ? 0 : lost * past_s) + kFlow_s * random.Normal());
      series->sigma_s.push_back(0);
    }
  }
  return lines;
}

PairedDifference Fit(const Lines& lines, double slip_s) {
  return FitPairedDifference(lines.acceleration, lines.deceleration, kAnswer_s + 0.7 * slip_s, 1,
                             0.7, {});
}

// 0.3 ms a line over six lines, and what the form of the slip leaves open: a tenth of the lags.
constexpr double kNear_s = 0.0005;

TEST(PairedDifference, ALinesOwnLagCancels) {
  for (const std::uint64_t seed : {1, 2, 3}) {
    const PairedDifference difference = Fit(TenLines(seed, kSlip_s), kSlip_s);
    EXPECT_NEAR(difference.value_s, kSlip_s, kNear_s) << seed;
    EXPECT_LT(std::abs(difference.value_s - kSlip_s), 2.5 * std::sqrt(difference.variance()));
    EXPECT_LT(std::sqrt(difference.variance()), kNear_s);
    EXPECT_FALSE(difference.cut_off);
  }
}

TEST(PairedDifference, WhatGapsLoseBeyondTheAnswerMovesItLittle) {
  for (const double lost : {0.0, 0.3, 0.6}) {
    EXPECT_NEAR(Fit(TenLines(1, kSlip_s, lost), kSlip_s).value_s, kSlip_s, kNear_s) << lost;
  }
}

TEST(PairedDifference, OneLineWithABlobCountsLittle) {
  Lines lines = TenLines(1, kSlip_s);
  lines.deceleration.excess_s[3] += 0.02;
  EXPECT_NEAR(Fit(lines, kSlip_s).value_s, kSlip_s, kNear_s);
}

TEST(PairedDifference, BelowZeroItIsFilamentThatGapsLost) {
  const PairedDifference difference = Fit(TenLines(1, 0, 0.8, 0.015), 0);
  EXPECT_TRUE(difference.cut_off);
  EXPECT_GE(difference.value_s, -std::sqrt(difference.variance()) * 1.001);
  for (const double influence : difference.influence) EXPECT_EQ(influence, 0);
}

}  // namespace
}  // namespace trammel::pressure_advance
