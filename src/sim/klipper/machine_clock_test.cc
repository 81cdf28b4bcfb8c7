#include <gtest/gtest.h>

#include "sim/klipper/motion_queue.h"

namespace trammel::sim {
namespace {

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

}  // namespace
}  // namespace trammel::sim
