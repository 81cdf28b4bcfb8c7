#include "tap/contact/float_lanes.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

namespace trammel::tap {
namespace {

TEST(FloatLanes, LogarithmIsRightToSinglePrecision) {
  constexpr double kTolerance = 2e-7;
  constexpr double kStep = 1.00137;
  double x = 1e-30;
  while (x < 1e30) {
    Floats lanes;
    for (std::size_t k = 0; k < kLanes; ++k, x *= kStep) {
      lanes[k] = static_cast<float>(x);
    }
    const Floats logs = Log(lanes);
    for (std::size_t k = 0; k < kLanes; ++k) {
      const double exact = std::log(static_cast<double>(lanes[k]));
      ASSERT_NEAR(logs[k], exact, kTolerance * std::max(1.0, std::abs(exact))) << lanes[k];
    }
  }
  EXPECT_EQ(Log(Floats{1, 1, 1, 1})[0], 0);
}

TEST(FloatLanes, ExponentialIsRightToSinglePrecision) {
  constexpr double kTolerance = 3e-7;
  constexpr double kStep = 0.00137;
  double x = -86.9;
  while (x < 87.5) {
    Floats lanes;
    for (std::size_t k = 0; k < kLanes; ++k, x += kStep) {
      lanes[k] = static_cast<float>(x);
    }
    const Floats exps = Exp(lanes);
    for (std::size_t k = 0; k < kLanes; ++k) {
      const double exact = std::exp(static_cast<double>(lanes[k]));
      ASSERT_NEAR(exps[k], exact, kTolerance * exact) << lanes[k];
    }
  }
  EXPECT_EQ(Exp(Floats{})[0], 1);
}

TEST(FloatLanes, ExponentialStaysTinyBelowItsRange) {
  const Floats exps = Exp(Floats{-88, -100, -1e6F, -1e30F});
  for (std::size_t k = 0; k < kLanes; ++k) {
    EXPECT_GE(exps[k], 0);
    EXPECT_LT(exps[k], 1e-37F);
  }
}

}  // namespace
}  // namespace trammel::tap
