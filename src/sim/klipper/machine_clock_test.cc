#include <gtest/gtest.h>

#include "sim/klipper/motion_queue.h"

namespace trammel::sim {
namespace {

TEST(MachineClock, RunsAtItsRateFromItsStart) {
  MachineClock clock(1000, 2);
  EXPECT_DOUBLE_EQ(clock.At(1000), 0);
  EXPECT_DOUBLE_EQ(clock.At(1003), 6);
  EXPECT_DOUBLE_EQ(clock.At(999), -2);
}

TEST(MachineClock, ChangesItsRateFromTheLatestMomentAskedForAndNothingBefore) {
  MachineClock clock(1000, 1);
  EXPECT_DOUBLE_EQ(clock.At(1010), 10);
  EXPECT_DOUBLE_EQ(clock.At(1005), 5);
  clock.SetRate(20);
  EXPECT_DOUBLE_EQ(clock.At(1005), 5);
  EXPECT_DOUBLE_EQ(clock.At(1010), 10);
  EXPECT_DOUBLE_EQ(clock.At(1011), 30);
  clock.SetRate(1);
  EXPECT_DOUBLE_EQ(clock.At(1013), 32);
  EXPECT_DOUBLE_EQ(clock.At(1010.5), 20);
  EXPECT_DOUBLE_EQ(clock.At(1009), 9);
}

TEST(MachineClock, NeverGoesBackWhereTheRateChangesOften) {
  MachineClock clock(0, 1);
  double last = clock.At(0);
  for (int i = 1; i <= 1000; ++i) {
    clock.SetRate(i % 2 == 0 ? 1 : 50);
    const double now = clock.At(0.01 * i);
    EXPECT_GT(now, last);
    last = now;
  }
  EXPECT_NEAR(last, 0.01 * (500 * 50 + 500), 1e-9);
}

}  // namespace
}  // namespace trammel::sim
