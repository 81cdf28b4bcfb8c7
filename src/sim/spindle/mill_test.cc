#include "sim/spindle/mill.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <string>

namespace trammel::sim {
namespace {

using ::testing::HasSubstr;

constexpr double kBegin_s = 100;

// A mill in MDI mode.
struct Ready {
  explicit Ready(const MillOptions& options = {}) : mill(options) {
    EXPECT_EQ(mill.Answer("set mode mdi", kBegin_s), "SET MODE ACK\n\r");
  }
  VirtualMill mill;
};

TEST(VirtualMill, MovesAtTheSpeedThatIsAskedForAndTellsWhereItIs) {
  Ready ready;
  EXPECT_EQ(ready.mill.Answer("get abs_act_pos", kBegin_s),
            "ABS_ACT_POS 600.000000 400.000000 520.000000 0.000000 0.000000 0.000000\r\n");
  (void)ready.mill.Answer("set mdi G21 G90 G94 G53 G1 X660 Y480 Z520 F6000", kBegin_s);
  const MillPlace half = ready.mill.At(kBegin_s + 0.5);  // 100 mm at 100 mm/s
  EXPECT_TRUE(half.moving);
  EXPECT_NEAR(half.stated_mm[0], 630, 1e-9);
  EXPECT_EQ(ready.mill.Answer("get program_status", kBegin_s + 0.5), "PROGRAM_STATUS RUNNING\r\n");
  const MillPlace there = ready.mill.At(kBegin_s + 1);
  EXPECT_FALSE(there.moving);
  EXPECT_EQ(there.stated_mm, (Triple{660, 480, 520}));
  EXPECT_EQ(there.approach, half.approach);
  (void)ready.mill.Answer("set mdi G21 G90 G94 G53 G1 C90 F5400", kBegin_s + 2);
  EXPECT_NEAR(ready.mill.At(kBegin_s + 2.5).c_deg, 45, 1e-9);
  EXPECT_EQ(ready.mill.At(kBegin_s + 2.5).turn, 1U);
}

TEST(VirtualMill, AnAbortStopsItWhereItIs) {
  Ready ready;
  (void)ready.mill.Answer("set mdi G53 G1 X700 F6000", kBegin_s);
  (void)ready.mill.Answer("set abort", kBegin_s + 0.25);
  const MillPlace stopped = ready.mill.At(kBegin_s + 5);
  EXPECT_FALSE(stopped.moving);
  EXPECT_NEAR(stopped.stated_mm[0], 625, 1e-9);
}

TEST(VirtualMill, RefusesWhatItsControllerWould) {
  MillOptions options;
  options.faults.refused_at_move = 2;
  Ready ready(options);
  (void)ready.mill.Answer("set mdi G53 G1 X1300 F6000", kBegin_s);
  EXPECT_THAT(ready.mill.Answer("get error", kBegin_s), HasSubstr("exceed X's positive limit"));
  EXPECT_EQ(ready.mill.Answer("get error", kBegin_s), "ERROR OK\r\n");
  (void)ready.mill.Answer("set mdi G53 G1 X601 F6000", kBegin_s);
  EXPECT_THAT(ready.mill.Answer("get error", kBegin_s), HasSubstr("would exceed joint 0"));
  EXPECT_EQ(ready.mill.At(kBegin_s + 9).stated_mm[0], 600);
  (void)ready.mill.Answer("set mode manual", kBegin_s);
  (void)ready.mill.Answer("set mdi G53 G1 X601 F6000", kBegin_s);
  EXPECT_THAT(ready.mill.Answer("get error", kBegin_s), HasSubstr("Must be in MDI mode"));
  EXPECT_EQ(ready.mill.Answer("get nonsense", kBegin_s), "GET NONSENSE NAK\r\n");
  EXPECT_EQ(ready.mill.Answer("nonsense", kBegin_s), "");
}

TEST(VirtualMill, ShowsTheLimitsOfItsAxes) {
  Ready ready;
  (void)ready.mill.Answer("set mdi (debug,trammel 1 #<_ini[AXIS_Y]MAX_LIMIT> #<_ini[AXIS_W]MAX>)",
                          kBegin_s);
  EXPECT_EQ(ready.mill.Answer("get operator_display", kBegin_s),
            "OPERATOR_DISPLAY trammel 1 800.000000 ######\r\n");
}

TEST(VirtualMill, AnEmergencyStopHaltsItHalfWayAndTakesItsPower) {
  MillOptions options;
  options.faults.estop_at_move = 1;
  Ready ready(options);
  (void)ready.mill.Answer("set mdi G53 G1 X700 F6000", kBegin_s);
  EXPECT_TRUE(ready.mill.At(kBegin_s + 0.25).moving);
  EXPECT_FALSE(ready.mill.At(kBegin_s + 0.75).moving);
  EXPECT_EQ(ready.mill.Answer("get machine", kBegin_s + 0.75), "MACHINE OFF\r\n");
  EXPECT_NEAR(ready.mill.At(kBegin_s + 9).stated_mm[0], 650, 1e-9);
}

TEST(VirtualMill, ALineThatDiesLeavesTheMoveToItsEnd) {
  MillOptions options;
  options.faults.silent_at_move = 1;
  Ready ready(options);
  EXPECT_TRUE(ready.mill.serves());
  (void)ready.mill.Answer("set mdi G53 G1 X700 F6000", kBegin_s);
  EXPECT_FALSE(ready.mill.serves());
  EXPECT_EQ(ready.mill.At(kBegin_s + 1).stated_mm[0], 700);
}

}  // namespace
}  // namespace trammel::sim
