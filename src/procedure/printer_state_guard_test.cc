#include "procedure/keeper.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>

#include "procedure/fake_printer.h"

namespace trammel::procedure {
namespace {

using ::testing::Contains;
using ::testing::HasSubstr;
using ::testing::IsEmpty;
using ::testing::Not;
using ::testing::SizeIs;

class KeeperTest : public ::testing::Test {
 protected:
  testing::FakePrinter printer_;
  pressure_advance::ScanSettings settings_;
  Session session_{printer_, {}, {}};

  Keeper Remembered() {
    settings_.lights_on_gcode = "LIGHTS_ON";
    auto keeper = Keeper::Remember(session_, settings_);
    EXPECT_TRUE(keeper.has_value());
    printer_.scripts.clear();
    return std::move(*keeper);
  }
};

TEST_F(KeeperTest, SwitchesTheLaserOffBeforeAnythingElse) {
  Keeper keeper = Remembered();
  EXPECT_THAT(keeper.Restore(), IsEmpty());
  ASSERT_THAT(printer_.scripts, Not(IsEmpty()));
  EXPECT_EQ(printer_.scripts.front(), "LASER_OFF");
  EXPECT_EQ(printer_.scripts[1], "LIGHTS_ON");
}

TEST_F(KeeperTest, BringsBackWhatWasSet) {
  Keeper keeper = Remembered();
  printer_.state.pressure_advance_s = 0.06;
  printer_.state.limits.max_accel_mm_s2 = 100;
  printer_.state.heaters["extruder"].target_c = 150;
  EXPECT_THAT(keeper.Restore(), IsEmpty());
  EXPECT_THAT(printer_.scripts, Contains("SET_PRESSURE_ADVANCE ADVANCE=0.031 SMOOTH_TIME=0.04"));
  EXPECT_THAT(printer_.scripts, Contains(HasSubstr("ACCEL=5000")));
  EXPECT_THAT(printer_.scripts, Contains("SET_HEATER_TEMPERATURE HEATER=extruder TARGET=205"));
  EXPECT_THAT(printer_.scripts, Contains("SET_HEATER_TEMPERATURE HEATER=heater_bed TARGET=60"));
  EXPECT_THAT(printer_.scripts, Contains("RESTORE_GCODE_STATE NAME=trammel MOVE=0"));
}

TEST_F(KeeperTest, TheDestructorRestoresWhatWasForgotten) {
  { const Keeper keeper = Remembered(); }
  EXPECT_THAT(printer_.scripts, Contains("LASER_OFF"));
}

TEST_F(KeeperTest, RestoresOnceOnly) {
  {
    Keeper keeper = Remembered();
    EXPECT_THAT(keeper.Restore(), IsEmpty());
    printer_.scripts.clear();
    EXPECT_THAT(keeper.Restore(), IsEmpty());
  }
  EXPECT_THAT(printer_.scripts, IsEmpty());
}

TEST_F(KeeperTest, OneRefusalDoesNotKeepTheRestFromComingBack) {
  Keeper keeper = Remembered();
  printer_.refused["LIGHTS_ON"] = "unknown command";
  const auto failures = keeper.Restore();
  ASSERT_THAT(failures, SizeIs(1));
  EXPECT_THAT(failures.front(), HasSubstr("LIGHTS_ON"));
  EXPECT_THAT(printer_.scripts, Contains("RESTORE_GCODE_STATE NAME=trammel MOVE=0"));
}

TEST_F(KeeperTest, StopsThePrinterWhereTheLaserCannotBeSwitchedOff) {
  Keeper keeper = Remembered();
  printer_.refused["LASER_OFF"] = "unknown command";
  const auto failures = keeper.Restore();
  EXPECT_TRUE(printer_.stopped);
  ASSERT_THAT(failures, SizeIs(1));
  EXPECT_THAT(failures.front(), HasSubstr("FIRMWARE_RESTART"));
}

TEST_F(KeeperTest, HeatsNothingAfterARestart) {
  Keeper keeper = Remembered();
  printer_.state.homed_axes = "";
  EXPECT_THAT(keeper.Restore(), IsEmpty());
  EXPECT_THAT(printer_.scripts, Not(Contains(HasSubstr("SET_HEATER_TEMPERATURE"))));
  EXPECT_THAT(printer_.scripts, Contains("LASER_OFF"));
}

TEST_F(KeeperTest, WaitsForALostPrinterAndThenRestores) {
  Keeper keeper = Remembered();
  printer_.state.readiness = machine::PrinterReadiness::kDisconnected;
  EXPECT_THAT(keeper.Restore(), IsEmpty());
  EXPECT_THAT(printer_.scripts, Contains("LASER_OFF"));
}

TEST_F(KeeperTest, BeginsAnewWhereTheLinkIsLostInTheMiddle) {
  Keeper keeper = Remembered();
  printer_.lost_at = "RESTORE_GCODE_STATE NAME=trammel MOVE=0";
  EXPECT_THAT(keeper.Restore(), IsEmpty());
  EXPECT_EQ(std::count(printer_.scripts.begin(), printer_.scripts.end(), "LASER_OFF"), 2);
  EXPECT_EQ(printer_.scripts.back(), "RESTORE_GCODE_STATE NAME=trammel MOVE=0");
}

TEST_F(KeeperTest, DoesNotStopAPrinterThatIsOnlyAway) {
  Keeper keeper = Remembered();
  printer_.lost_at = "LASER_OFF";
  EXPECT_THAT(keeper.Restore(), IsEmpty());
  EXPECT_FALSE(printer_.stopped);
}

TEST_F(KeeperTest, EndsThePrintersOwnLimitAtTheVeryEnd) {
  session_.has_limit = true;
  Keeper keeper = Remembered();
  EXPECT_THAT(keeper.Restore(), IsEmpty());
  EXPECT_EQ(printer_.scripts.back(), "TRAMMEL_RELEASE");
}

TEST_F(KeeperTest, CancelsAPrintThatStillRuns) {
  Keeper keeper = Remembered();
  printer_.state.print_state = "printing";
  EXPECT_THAT(keeper.Restore(), IsEmpty());
  EXPECT_EQ(printer_.state.print_state, "cancelled");
}

TEST_F(KeeperTest, SaysSoWhereThePrinterStaysAway) {
  Keeper keeper = Remembered();
  printer_.state.readiness = machine::PrinterReadiness::kDisconnected;
  printer_.comes_back = false;
  const auto failures = keeper.Restore();
  ASSERT_THAT(failures, SizeIs(1));
  EXPECT_THAT(failures.front(), HasSubstr("make sure that laser and heaters are off"));
}

TEST_F(KeeperTest, AShutDownPrinterIsLeftToItsOwnShutdownValues) {
  Keeper keeper = Remembered();
  printer_.state.readiness = machine::PrinterReadiness::kShutdown;
  printer_.refused["LASER_OFF"] = "Shutdown due to webhooks request";
  const auto failures = keeper.Restore();
  EXPECT_FALSE(printer_.stopped);
  ASSERT_THAT(failures, SizeIs(1));
  EXPECT_THAT(failures.front(), HasSubstr("shut down"));
}

}  // namespace
}  // namespace trammel::procedure
