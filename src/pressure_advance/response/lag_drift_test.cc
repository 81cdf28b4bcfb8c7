#include "pressure_advance/response/lag_drift.h"

#include <gtest/gtest.h>

#include <cmath>

namespace trammel::pressure_advance {
namespace {

constexpr LagDriftOptions kOptions;

TEST(LagDrift, GainIsWhatAFirstOrderLagHasLaidDown) {
  // Steps dm/dt = 1 - m / lag along the ramp, then dm/dt = -m / lag; the gain is the integral of m
  // over the ramp's.
  for (const double lag_s : {0.005, 0.03, 0.06}) {
    constexpr double kRamp_s = 0.048, kDrain_s = 0.04, kStep_s = 1e-6;
    double missing = 0, laid = 0;
    for (double t = 0; t < kRamp_s + kDrain_s; t += kStep_s) {
      missing += kStep_s * ((t < kRamp_s ? 1 : 0) - missing / lag_s);
      laid += kStep_s * missing;
    }
    EXPECT_NEAR(GainOfALinearLag(lag_s, kRamp_s, kDrain_s), laid / (kRamp_s * lag_s), 1e-3);
  }
}

TEST(LagDrift, ASlopeOfTheExpectedGainShowsNone) {
  const LagDrift drift = EstimateLagDrift(0.86, 0.01, 0.86, 0, kOptions);
  EXPECT_NEAR(drift.mean, 0, 1e-12);
  EXPECT_LT(drift.sigma, 0.02);
}

TEST(LagDrift, ASteeperOrFlatterSlopeShowsItsSign) {
  EXPECT_NEAR(EstimateLagDrift(0.86 * 0.9, 0.005, 0.86, 0, kOptions).mean, 0.1, 0.005);
  EXPECT_NEAR(EstimateLagDrift(0.86 * 1.1, 0.005, 0.86, 0, kOptions).mean, -0.1, 0.005);
}

TEST(LagDrift, AThinningTailLeavesTheGainOpen) {
  const LagDrift drift = EstimateLagDrift(0.93, 0.005, 0.86, 0.05, kOptions);
  EXPECT_NEAR(drift.mean, 0, 0.01);
  EXPECT_GT(drift.sigma, 0.03);
}

}  // namespace
}  // namespace trammel::pressure_advance
