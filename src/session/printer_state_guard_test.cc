#include "session/printer_state_guard.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>

#include "base/bug_note.h"
#include "base/check.h"
#include "session/guarded_printer_test_support.h"
#include "session/print.h"
#include "support/matchers.h"

namespace trammel::procedure {
namespace {

using procedure::testing::GuardedPrinter;
using procedure::testing::kMark;
using procedure::testing::kNozzleOff;
using ::testing::AllOf;
using ::testing::Contains;
using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::IsEmpty;
using ::testing::Not;
using ::testing::SizeIs;

class PrinterStateGuardTest : public GuardedPrinter {};

TEST_F(PrinterStateGuardTest, BringsBackOnceWhatWasSetFromTheLaserToThePrintersOwnLimit) {
  PrinterStateGuard guard = Begun();
  printer_.state.pressure_advance["extruder"].advance_s = 0.06;
  printer_.state.limits.max_accel_mm_s2 = 100;
  printer_.state.heaters["extruder"].target_c = 150;
  EXPECT_THAT(guard.Restore(), IsEmpty());
  EXPECT_EQ(printer_.scripts.front(), "LASER_OFF");
  EXPECT_EQ(printer_.scripts.back(), "_TRAMMEL_RELEASE OWNER=" + session_.owner);
  for (const char* script : {"LIGHTS_ON", "SET_PRESSURE_ADVANCE EXTRUDER=extruder ADVANCE=0.031",
                             "SET_HEATER_TEMPERATURE HEATER=extruder TARGET=205",
                             "SET_HEATER_TEMPERATURE HEATER=heater_bed TARGET=60", kMark}) {
    EXPECT_THAT(printer_.scripts, Contains(script));
  }
  EXPECT_THAT(printer_.scripts, Contains(HasSubstr("ACCEL=5000")));
  EXPECT_THAT(printer_.deleted, ElementsAre("trammel_run-1.gcode"));
  EXPECT_THAT(said_, Contains(HasSubstr("left on, as they were before: extruder 205 degC")));
  printer_.scripts.clear();
  EXPECT_THAT(guard.Restore(), IsEmpty());
  EXPECT_THAT(printer_.scripts, IsEmpty());
}

TEST_F(PrinterStateGuardTest, ALinkThatIsLostInTheMiddleIsWaitedForAndNoReasonToStopThePrinter) {
  for (const char* where : {kMark, "LASER_OFF"}) {
    PrinterStateGuard guard = Begun();
    printer_.lost_at = where;
    EXPECT_THAT(guard.Restore(), IsEmpty());
    EXPECT_EQ(std::count(printer_.scripts.begin(), printer_.scripts.end(), "LASER_OFF"), 2);
    EXPECT_FALSE(printer_.stopped);
  }
}

TEST_F(PrinterStateGuardTest, AHeaterThatSomebodySwitchedOffMeanwhileIsNotHeatedAgain) {
  PrinterStateGuard guard = Begun();
  ASSERT_TRUE(SetTarget(session_, "extruder", 150));
  printer_.state.heaters["extruder"].target_c = 150;
  printer_.state.heaters["heater_bed"].target_c = 0;  // Cooldown, or the idle time-out
  EXPECT_THAT(guard.Restore(), ElementsAre(AllOf(HasSubstr("stay off"), HasSubstr("heater_bed 60"),
                                                 Not(HasSubstr("extruder")))));
  EXPECT_THAT(printer_.scripts, Contains("SET_HEATER_TEMPERATURE HEATER=extruder TARGET=205"));
  EXPECT_THAT(printer_.scripts, Not(Contains(HasSubstr("HEATER=heater_bed TARGET=60"))));
  EXPECT_EQ(Journals(), 0U);
}

TEST_F(PrinterStateGuardTest, ABugInWhatListensKeepsNothingFromComingBack) {
  bool broken = false;
  session_.tell = [&broken](const Progress& progress) {
    if (broken) throw Bug(progress.text);
  };
  {
    const PrinterStateGuard guard = Begun();
    printer_.refused["LASER_OFF"] = "no";  // so that there is something to say
    broken = true;
  }
  EXPECT_THAT(printer_.scripts, Contains("LASER_OFF"));
  EXPECT_TRUE(printer_.stopped);
  EXPECT_TRUE(NotedBug());
}

TEST_F(PrinterStateGuardTest, OneRefusalDoesNotKeepTheRestFromComingBack) {
  PrinterStateGuard guard = Begun();
  printer_.state.pressure_advance["extruder"].advance_s = 0.06;
  printer_.refused["LIGHTS_ON"] = "unknown command";
  const auto failures = guard.Restore();
  ASSERT_THAT(failures, SizeIs(1));
  EXPECT_THAT(failures.front(), HasSubstr("LIGHTS_ON"));
  EXPECT_THAT(printer_.scripts, Contains(HasSubstr("SET_PRESSURE_ADVANCE")));
  EXPECT_THAT(printer_.scripts, Not(Contains(HasSubstr("TRAMMEL_RELEASE"))));
  EXPECT_EQ(Journals(), 1U) << "the next run brings it back";
}

TEST_F(PrinterStateGuardTest, APrinterWhoseLaserWasNeverLitIsNotStoppedForIt) {
  auto guard = Must(Take());
  ASSERT_TRUE(guard.Begin(session_));
  printer_.refused["LASER_OFF"] = "waited 60 s behind another's M190";
  printer_.state.print_state = "printing";
  printer_.state.print_file = "somebody_elses.gcode";
  const auto failures = guard.Restore();
  EXPECT_FALSE(printer_.stopped);
  ASSERT_FALSE(failures.empty());
  EXPECT_THAT(failures.front(), HasSubstr("somebody_elses.gcode"));
}

TEST_F(PrinterStateGuardTest, AnEmergencyStopForTheLaserNamesTheJobThatItEnds) {
  PrinterStateGuard guard = Begun();
  printer_.refused["LASER_OFF"] = "waited 60 s behind another's M190";
  printer_.state.print_state = "printing";
  printer_.state.print_file = "somebody_elses.gcode";
  const auto failures = guard.Restore();
  EXPECT_TRUE(printer_.stopped);
  ASSERT_THAT(failures, SizeIs(1));
  EXPECT_THAT(failures.front(), Containing("somebody_elses.gcode is printing", "FIRMWARE_RESTART"));
}

TEST_F(PrinterStateGuardTest, APrinterThatTellsNothingIsStoppedForALaserThatWasLit) {
  PrinterStateGuard guard = Begun();
  printer_.refused["LASER_OFF"] = "unknown command";
  printer_.deaf_after = "LASER_OFF";
  EXPECT_THAT(guard.Restore(), ElementsAre(HasSubstr("stopped instead")));
  EXPECT_TRUE(printer_.stopped);
}

TEST_F(PrinterStateGuardTest, HeatsNothingAfterARestartAndSaysSo) {
  PrinterStateGuard guard = Begun();
  printer_.state.homed_axes = "";
  printer_.refused[kMark] = "!! Unknown g-code state: trammel_run-1";
  EXPECT_THAT(guard.Restore(),
              ElementsAre(AllOf(HasSubstr("restarted"), HasSubstr("extruder 205"))));
  EXPECT_TRUE(guard.restarted());
  EXPECT_THAT(printer_.scripts, Contains(kNozzleOff));
  EXPECT_THAT(printer_.scripts, Not(Contains(HasSubstr("TARGET=205"))));
  EXPECT_THAT(printer_.scripts, Contains("LASER_OFF"));
  EXPECT_EQ(Journals(), 0U);
}

TEST_F(PrinterStateGuardTest, ARestartDuringALostLinkIsKnownFromTheForgottenState) {
  PrinterStateGuard guard = Begun();
  printer_.state.readiness = machine::PrinterReadiness::kDisconnected;
  // Homed again by somebody, before the link is back.
  printer_.refused[kMark] = "!! Unknown g-code state: trammel_run-1";
  EXPECT_THAT(guard.Restore(), ElementsAre(HasSubstr("restarted")));
  EXPECT_THAT(printer_.scripts, Not(Contains(HasSubstr("TARGET=205"))));
}

TEST_F(PrinterStateGuardTest, MotorsThatWereSwitchedOffAreNoRestart) {
  PrinterStateGuard guard = Begun();
  printer_.state.homed_axes = "";
  printer_.state.heaters["extruder"].target_c = 150;
  EXPECT_THAT(guard.Restore(), ElementsAre(HasSubstr("motors")));
  EXPECT_FALSE(guard.restarted());
  EXPECT_THAT(printer_.scripts, Contains("SET_HEATER_TEMPERATURE HEATER=extruder TARGET=205"));
}

TEST_F(PrinterStateGuardTest, InDoubtWhoseThePrinterIsTheHeatersGoOffAndWhatStaysIsSaid) {
  PrinterStateGuard guard = Begun();
  printer_.state.print_state = "printing";
  printer_.state.print_file = "trammel_run-1.gcode";
  printer_.deaf_after = "CANCEL_PRINT";
  printer_.deaf_for = 2;
  EXPECT_THAT(guard.Restore(),
              ElementsAre(AllOf(
                  HasSubstr("no answer within 10 s"),
                  HasSubstr("target of extruder 205 degC, target of heater_bed 60 degC"),
                  HasSubstr("pressure advance of extruder 0.031 s"), HasSubstr("5000 mm/s2"))));
  EXPECT_THAT(printer_.scripts, Contains(kNozzleOff));
  EXPECT_THAT(printer_.scripts, Contains("SET_HEATER_TEMPERATURE HEATER=heater_bed TARGET=0"));
  EXPECT_THAT(printer_.scripts, Not(Contains(HasSubstr("TARGET=205"))));
  EXPECT_THAT(printer_.scripts, Not(Contains(HasSubstr("SET_PRESSURE_ADVANCE"))));
  EXPECT_THAT(printer_.scripts, Not(Contains(kMark)));
  EXPECT_THAT(printer_.scripts, Contains("LIGHTS_ON"));
  EXPECT_EQ(Journals(), 1U) << "the next run brings it back";
}

TEST_F(PrinterStateGuardTest, HeatersThatCannotBeLookedAtGoOff) {
  PrinterStateGuard guard = Begun();
  printer_.state.pressure_advance["extruder"].advance_s = 0.06;
  printer_.deaf_after = "SET_PRESSURE_ADVANCE EXTRUDER=extruder ADVANCE=0.031";
  EXPECT_THAT(guard.Restore(), ElementsAre(AllOf(HasSubstr("cannot be looked at"),
                                                 HasSubstr("of extruder 205 degC"))));
  EXPECT_THAT(printer_.scripts, Contains(kNozzleOff));
  EXPECT_THAT(printer_.scripts, Not(Contains(HasSubstr("TARGET=205"))));
}

// Limits and pressure advance would come back into the lines that it still prints.
TEST_F(PrinterStateGuardTest, NothingIsBroughtBackIntoARunsOwnPrintThatCannotBeEnded) {
  PrinterStateGuard guard = Begun();
  printer_.state.print_state = "printing";
  printer_.state.print_file = "trammel_run-1.gcode";
  printer_.state.pressure_advance["extruder"].advance_s = 0.06;
  printer_.cannot_cancel = true;
  printer_.refused["SDCARD_RESET_FILE"] = "no";
  EXPECT_THAT(guard.Restore(), ElementsAre(HasSubstr("it goes on")));
  EXPECT_THAT(printer_.scripts, Not(Contains(HasSubstr("SET_PRESSURE_ADVANCE"))));
  EXPECT_THAT(printer_.scripts, Not(Contains(HasSubstr("SET_VELOCITY_LIMIT"))));
  EXPECT_THAT(printer_.scripts, Not(Contains(kMark)));
  EXPECT_EQ(Journals(), 1U) << "the next run brings it back";
}

TEST_F(PrinterStateGuardTest, ALaserThatNobodyLitWaitsForTheEndOfThePrint) {
  auto guard = Take();
  ASSERT_TRUE(guard && guard->Begin(session_));
  printer_.state.print_state = "printing";
  printer_.state.print_file = "trammel_run-1.gcode";
  printer_.scripts.clear();
  EXPECT_THAT(guard->Restore(), IsEmpty());
  ASSERT_THAT(printer_.scripts, SizeIs(::testing::Gt(2)));
  EXPECT_EQ(printer_.scripts[0], "CANCEL_PRINT");
  EXPECT_EQ(printer_.scripts[1], "LASER_OFF");
}

// A print that blocks refuses the run's last commands; they are no reason to undo later what it
// set.
TEST_F(PrinterStateGuardTest, WhatIsLeftToAnothersJobIsNothingForTheNextRun) {
  PrinterStateGuard guard = Begun();
  printer_.state.print_state = "printing";
  printer_.state.print_file = "vase.gcode";
  printer_.refused["LIGHTS_ON"] = "did not finish within 5 s";
  printer_.refused[kRelease + (" OWNER=" + session_.owner)] = "did not finish within 5 s";
  EXPECT_THAT(guard.Restore(), SizeIs(3));
  EXPECT_EQ(Journals(), 0U);
}

TEST_F(PrinterStateGuardTest, EachMotorsPressureAdvanceComesBackByItsOwnName) {
  printer_.state.active_extruder = "extruder1";
  printer_.state.pressure_advance["extruder1"] = {0.05, 0.02, "extruder1"};
  printer_.state.pressure_advance["extruder_stepper belted"] = {0.07, {}, "extruder1"};
  PrinterStateGuard guard = Begun();
  printer_.state.active_extruder = "extruder";  // T0 again, by hand
  printer_.state.pressure_advance["extruder1"].advance_s = 0;
  printer_.state.pressure_advance["extruder_stepper belted"].advance_s = 0;
  EXPECT_THAT(guard.Restore(), IsEmpty());
  EXPECT_THAT(printer_.scripts, Contains("SET_PRESSURE_ADVANCE EXTRUDER=extruder1 ADVANCE=0.05"));
  EXPECT_THAT(printer_.scripts, Contains("SET_PRESSURE_ADVANCE EXTRUDER=belted ADVANCE=0.07"));
  EXPECT_THAT(printer_.scripts, Not(Contains(HasSubstr("EXTRUDER=extruder ")))) << "untouched";
}

TEST_F(PrinterStateGuardTest, WhatAScriptSetsIsOnTheDiskBeforeItIsSent) {
  PrinterStateGuard guard = Begun();
  ASSERT_TRUE(RunNoted(session_, "SET_PRESSURE_ADVANCE ADVANCE=0.06 ; line 1\nM204 S3000\nG91", 1));
  const auto journals = files::ReadAllJournals(folder_.path());
  ASSERT_EQ(journals.size(), 1U);
  const auto& given = journals.begin()->second.given;
  EXPECT_THAT(given.at("pressure_advance extruder"), ElementsAre(0.06));
  EXPECT_THAT(given.at("max_accel"), ElementsAre(3000));
  EXPECT_THAT(given.at("absolute_coordinates"), ElementsAre(0));
}

TEST_F(PrinterStateGuardTest, AnothersJobIsNeitherCancelledNorCooled) {
  PrinterStateGuard guard = Begun();
  guard.ParkAt({20, 5, 6, 5, 150});
  printer_.state.print_state = "printing";
  printer_.state.print_file = "vase.gcode";
  printer_.state.heaters["extruder"].target_c = 240;
  const auto failures = guard.Restore();
  EXPECT_THAT(failures, ElementsAre(AllOf(HasSubstr("vase.gcode is printing"),
                                          HasSubstr("target of extruder 240 degC (was 205)"))));
  EXPECT_EQ(printer_.state.print_state, "printing");
  EXPECT_THAT(printer_.scripts, Not(Contains(HasSubstr("SET_HEATER"))));
  EXPECT_THAT(printer_.scripts, Not(Contains(HasSubstr("G91"))));
  EXPECT_EQ(printer_.scripts.front(), "LASER_OFF");
}

TEST_F(PrinterStateGuardTest, SaysSoWhereThePrinterStaysAway) {
  PrinterStateGuard guard = Begun();
  printer_.state.readiness = machine::PrinterReadiness::kDisconnected;
  printer_.comes_back = false;
  const auto failures = guard.Restore();
  ASSERT_THAT(failures, SizeIs(1));
  EXPECT_THAT(failures.front(), HasSubstr("make sure that laser and heaters are off"));
  EXPECT_EQ(Journals(), 1U);
}

TEST_F(PrinterStateGuardTest, AShutDownPrinterIsLeftToItsOwnShutdownValues) {
  PrinterStateGuard guard = Begun();
  printer_.state.readiness = machine::PrinterReadiness::kShutdown;
  printer_.refused["LASER_OFF"] = "Shutdown due to webhooks request";
  const auto failures = guard.Restore();
  EXPECT_FALSE(printer_.stopped);
  ASSERT_THAT(failures, SizeIs(1));
  EXPECT_THAT(failures.front(), HasSubstr("shut down"));
}

TEST_F(PrinterStateGuardTest, NotesOnDiskBeforeThePrinterIsToldAnything) {
  const auto guard = PrinterStateGuard::Take(
      session_, settings_, {"run-1", "now", address_, folder_.path() / "missing"});
  ASSERT_FALSE(guard);
  EXPECT_THAT(printer_.scripts, IsEmpty());
}

TEST_F(PrinterStateGuardTest, APrinterThatAnotherComputersRunHasIsNotTaken) {
  printer_.told = {{"gcode_macro _TRAMMEL_RUN", {{"owner", "laptop.run-7"}}}};
  EXPECT_THAT(Take(), FailsWith("laptop.run-7"));
  EXPECT_THAT(printer_.scripts, IsEmpty());
  EXPECT_EQ(Journals(), 0U);
}

TEST_F(PrinterStateGuardTest, ARefusedClaimLeavesNothingBehind) {
  session_.owner = "";
  const auto first = Take();
  ASSERT_TRUE(first);
  const std::string claim = printer_.scripts.back();
  EXPECT_THAT(claim, HasSubstr("_TRAMMEL_KEEP_ALIVE OWNER="));
  printer_.refused[claim] = "laptop.run-7 has this printer";
  printer_.scripts.clear();
  EXPECT_THAT(
      PrinterStateGuard::Take(session_, settings_, {"run-1", "now", "other.local", folder_.path()}),
      FailsWith("laptop.run-7"));
  EXPECT_THAT(printer_.scripts, ElementsAre(claim));
  EXPECT_EQ(Journals(), 1U) << "the first one's alone";
}

TEST_F(PrinterStateGuardTest, NothingIsTakenWhileSomebodyPrints) {
  printer_.state.print_state = "printing";
  printer_.state.print_file = "vase.gcode";
  EXPECT_FALSE(Take());
  EXPECT_THAT(printer_.scripts, IsEmpty());
}

TEST_F(PrinterStateGuardTest, HeatersEndOffWherePaperLiesOnTheBedWhateverTheyWereAt) {
  RunIdentity identity{"run-1", "2026-11-22T10:00:00", address_, folder_.path()};
  identity.heaters_end_off = true;
  identity.without_laser = true;
  auto guard = Must(PrinterStateGuard::Take(session_, settings_, identity));
  ASSERT_TRUE(guard.Begin(session_));
  printer_.scripts.clear();
  EXPECT_THAT(guard.Restore(), IsEmpty());
  EXPECT_THAT(printer_.scripts, Contains(kNozzleOff));
  EXPECT_THAT(printer_.scripts, Contains("SET_HEATER_TEMPERATURE HEATER=heater_bed TARGET=0"));
  // A printer without a laser has no LASER_OFF.
  EXPECT_THAT(printer_.scripts, Not(Contains("LASER_OFF")));
  EXPECT_THAT(printer_.scripts, Not(Contains("LIGHTS_ON")));
}

// M84 of somebody else and that of its own file's end look alike.
TEST_F(PrinterStateGuardTest, MotorsThatThePrintsOwnEndSwitchesOffAreNoLoss) {
  for (const bool own : {false, true}) {
    printer_.state.homed_axes = "xyz";
    RunIdentity identity{"run-1", "2026-11-22T10:00:00", address_, folder_.path()};
    identity.may_unhome = own;
    auto guard = Must(PrinterStateGuard::Take(session_, settings_, identity));
    ASSERT_TRUE(guard.Begin(session_));
    printer_.state.homed_axes = "";
    const auto lost = guard.Restore();
    EXPECT_EQ(lost.empty(), own) << (lost.empty() ? "" : lost.front());
  }
}

TEST_F(PrinterStateGuardTest,
       WhereToolsChangeTheOffsetThatIsInForceStaysAndPressureAdvanceIsItsExtrudersOwn) {
  RunIdentity identity{"run-1", "2026-11-22T10:00:00", address_, folder_.path()};
  identity.changes_tools = true;
  auto guard = Must(PrinterStateGuard::Take(session_, settings_, identity));
  ASSERT_TRUE(guard.Begin(session_));
  printer_.state.active_extruder = "extruder1";
  printer_.state.pressure_advance["extruder"].advance_s = 0.05;
  printer_.state.gcode.homing_origin_mm = {0.25, -0.5, 1.5, 0};
  printer_.scripts.clear();
  EXPECT_THAT(guard.Restore(), IsEmpty());
  EXPECT_THAT(printer_.scripts, Contains(std::string(kMark) +
                                         "\nSET_GCODE_OFFSET X=0.250000 Y=-0.500000 Z=1.500000"));
  EXPECT_THAT(printer_.scripts, Contains("SET_PRESSURE_ADVANCE EXTRUDER=extruder ADVANCE=0.031"));
}

}  // namespace
}  // namespace trammel::procedure
