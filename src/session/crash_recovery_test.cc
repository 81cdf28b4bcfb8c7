#include "session/crash_recovery.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "session/guarded_printer_test_support.h"
#include "support/matchers.h"

namespace trammel::procedure {
namespace {

using procedure::testing::GuardedPrinter;
using procedure::testing::kMark;
using procedure::testing::kNozzleOff;
using ::testing::AllOf;
using ::testing::Contains;
using ::testing::HasSubstr;
using ::testing::Not;

class DeadRunTest : public GuardedPrinter {
 protected:
  // Simulates a crash of the process here, after a script.
  void Die(const std::string& script = "G90") {
    const auto path = files::JournalPath(folder_.path(), PlainAddress(address_));
    {
      PrinterStateGuard guard = Begun();
      EXPECT_TRUE(RunNoted(session_, script, 1));
      kept_ = test::ReadWhole(path);
    }
    test::WriteWhole(path, kept_);
    printer_.scripts.clear();
    said_.clear();
  }

 private:
  std::string kept_;
};

TEST_F(DeadRunTest, WhatADeadRunLeftIsBroughtBackAndNotTakenForBefore) {
  printer_.state.heaters["extruder"].target_c = 0;
  printer_.state.heaters["heater_bed"].target_c = 0;
  Die("M104 S190\nSET_PRESSURE_ADVANCE ADVANCE=0.09\nSET_VELOCITY_LIMIT ACCEL=3000");
  printer_.state.pressure_advance["extruder"].advance_s = 0.09;
  printer_.state.limits.max_accel_mm_s2 = 3000;
  printer_.state.heaters["extruder"].target_c = 190;
  const auto guard = Take("run-2");
  ASSERT_TRUE(guard);
  EXPECT_THAT(printer_.scripts.front(), HasSubstr(kMark));
  EXPECT_THAT(printer_.scripts, Contains("LASER_OFF"));
  EXPECT_THAT(printer_.scripts, Contains("SET_PRESSURE_ADVANCE EXTRUDER=extruder ADVANCE=0.031"));
  EXPECT_THAT(printer_.scripts, Contains(HasSubstr("ACCEL=5000")));
  EXPECT_THAT(printer_.scripts, Contains(kNozzleOff));
  EXPECT_THAT(said_, Contains(AllOf(HasSubstr("died here: brought back acceleration limit 3000"),
                                    HasSubstr("pressure advance of extruder 0.09 s -> 0.031"),
                                    HasSubstr("target of extruder 190 degC -> off"))));
  EXPECT_THAT(printer_.deleted, Contains("trammel_run-1.gcode"));
}

TEST_F(DeadRunTest, OfADeadRunBeforeARestartNothingIsBroughtBack) {
  Die();
  printer_.refused[kMark] = "!! Unknown g-code state: trammel_run-1";
  const auto guard = Take("run-2");
  ASSERT_TRUE(guard);
  EXPECT_THAT(printer_.scripts, Not(Contains(HasSubstr("SET_PRESSURE_ADVANCE"))));
  EXPECT_THAT(printer_.scripts, Not(Contains(HasSubstr("SET_HEATER"))));
  EXPECT_THAT(said_, Contains(HasSubstr("nothing of it is left")));
}

TEST_F(DeadRunTest, ARunWhosePrinterWasStoppedIsNotSaidToHaveDied) {
  {
    PrinterStateGuard stopped = Begun();
    printer_.state.readiness = machine::PrinterReadiness::kShutdown;
    printer_.state.message = "Shutdown due to webhooks request\nOnce the underlying issue …";
    printer_.refused["LASER_OFF"] = "Shutdown due to webhooks request";
    EXPECT_THAT(stopped.Restore(), ::testing::SizeIs(1));
  }
  // Its owner restarts the printer.
  printer_.state.readiness = machine::PrinterReadiness::kReady;
  printer_.state.message.clear();
  printer_.refused.clear();
  printer_.refused[kMark] = "!! Unknown g-code state: trammel_run-1";
  EXPECT_THAT(
      DescribeDeadRun(session_, folder_.path(), PlainAddress(address_)),
      HasSubstr("the printer was shut down (Shutdown due to webhooks request): nothing to"));
  said_.clear();
  ASSERT_TRUE(Take("run-2"));
  EXPECT_THAT(said_, Contains(HasSubstr("as the printer was shut down (Shutdown due to webhooks "
                                        "request), and nothing of it is left on the printer")));
  EXPECT_THAT(said_, Not(Contains(HasSubstr("died"))));
}

TEST_F(DeadRunTest, AfterAnotherPrintNothingIsUndoneThoughItHasTheDeadRunsValue) {
  Die("M204 S3000\nM104 S215");
  printer_.state.limits.max_accel_mm_s2 = 3000;
  printer_.state.heaters["extruder"].target_c = 215;
  printer_.state.print_file = "vase.gcode";
  printer_.state.print_state = "complete";
  printer_.state.print_total_s = 3600;
  ASSERT_TRUE(Take("run-2"));
  EXPECT_THAT(printer_.scripts, Not(Contains(HasSubstr("SET_VELOCITY_LIMIT"))));
  EXPECT_THAT(printer_.scripts, Not(Contains(kNozzleOff)));
  EXPECT_THAT(said_, Contains(AllOf(HasSubstr("because vase.gcode was printed since"),
                                    HasSubstr("acceleration limit 3000 mm/s2 (before that run "
                                              "5000)"))));
}

TEST_F(DeadRunTest, ThePrintBeforeItIsNoPrintSinceUnlessItWasMadeAgain) {
  printer_.state.print_file = "vase.gcode";
  printer_.state.print_total_s = 3600;
  Die("M204 S3000");
  printer_.state.limits.max_accel_mm_s2 = 3000;
  const auto brings_back = [this] {
    return DescribeDeadRun(session_, folder_.path(), PlainAddress(address_))
               .find("brings back acceleration") != std::string::npos;
  };
  EXPECT_TRUE(brings_back());
  printer_.state.print_file = "trammel_run-1.gcode";
  EXPECT_TRUE(brings_back()) << "its own";
  printer_.state.print_file = "vase.gcode";
  printer_.state.print_total_s = 3599;
  EXPECT_FALSE(brings_back());
}

TEST_F(DeadRunTest, ADeadRunOnTheSecondToolIsBroughtBackOntoThat) {
  printer_.state.active_extruder = "extruder1";
  printer_.state.pressure_advance["extruder1"] = {0.05, 0.04, "extruder1"};
  Die("SET_PRESSURE_ADVANCE ADVANCE=0.01");
  printer_.state.pressure_advance["extruder1"].advance_s = 0.01;
  printer_.state.active_extruder = "extruder";
  ASSERT_TRUE(Take("run-2"));
  EXPECT_THAT(printer_.scripts, Contains("SET_PRESSURE_ADVANCE EXTRUDER=extruder1 ADVANCE=0.05"));
  EXPECT_THAT(printer_.scripts, Not(Contains(HasSubstr("EXTRUDER=extruder "))));
}

TEST_F(DeadRunTest, AnotherPrintersJournalIsLeftAlone) {
  Die();
  const auto guard =
      PrinterStateGuard::Take(session_, settings_, {"run-2", "now", "other.local", folder_.path()});
  ASSERT_TRUE(guard);
  EXPECT_THAT(printer_.scripts, Not(Contains(HasSubstr(kMark))));
  EXPECT_EQ(Journals(), 2U);
}

TEST_F(DeadRunTest, ADeadRunIsKnownByThePrintersOwnWordUnderAnotherAddress) {
  Die();
  printer_.told = {{"gcode_macro _TRAMMEL_RUN", {{"owner", session_.owner}}}};
  const auto guard =
      PrinterStateGuard::Take(session_, settings_, {"run-2", "now", "192.168.1.7", folder_.path()});
  ASSERT_TRUE(guard);
  EXPECT_THAT(printer_.scripts, Contains(HasSubstr(kMark)));
  EXPECT_EQ(Journals(), 1U);
}

TEST_F(DeadRunTest, AJournalThatCannotBeReadSwitchesTheHeatersOff) {
  Die();
  test::WriteWhole(files::JournalPath(folder_.path(), PlainAddress(address_)), "{\"format\": 1");
  const auto guard = Take("run-2");
  ASSERT_TRUE(guard);
  EXPECT_THAT(printer_.scripts, Contains(kNozzleOff));
  EXPECT_THAT(said_, Contains(HasSubstr("cannot be read")));
}

TEST_F(DeadRunTest, WhereADeadRunCannotBeFinishedNothingIsBegun) {
  Die();
  printer_.refused["LASER_OFF"] = "unknown command";
  EXPECT_THAT(Take("run-2"), FailsWith("unknown command"));
  EXPECT_EQ(Journals(), 1U);
}

TEST_F(DeadRunTest, NoOtherPrintIsEnded) {
  const auto expect_left_alone = [this] {
    ASSERT_TRUE(EndDeadPrint(session_, folder_.path(), address_, {.lift_mm = 5}));
    EXPECT_THAT(printer_.scripts, ::testing::IsEmpty());
  };
  printer_.state.print_state = "printing";
  printer_.state.print_file = "trammel_run-1.gcode";
  expect_left_alone();  // no run died here
  printer_.state.print_state = "standby";
  Die();
  expect_left_alone();
  printer_.state.print_state = "printing";
  printer_.state.print_file = "vase.gcode";
  expect_left_alone();
  printer_.state.print_file = "trammel_run-1.gcode";
  const auto alive = files::FileLock::Take(files::LockPath(folder_.path(), PlainAddress(address_)),
                                           "a run that is alive");
  expect_left_alone();
}

TEST_F(DeadRunTest, TheSamePrinterHasOneAddressHoweverItIsWritten) {
  EXPECT_EQ(PlainAddress("localhost"), PlainAddress("http://127.0.0.1:7125/"));
  EXPECT_EQ(PlainAddress("voron.local"), PlainAddress("ws://voron.local:7125/websocket"));
  EXPECT_NE(PlainAddress("localhost:7125"), PlainAddress("localhost:7126"));
  for (const char* address : {"localhost", "127.0.0.1:7125", "http://LOCALHOST:7125/", "[::1]",
                              "http://localhost", "https://localhost/websocket", "localhost:80"}) {
    EXPECT_EQ(PrinterName(address), "localhost:7125") << address;
  }
  EXPECT_EQ(PrinterName(PrinterName("voron.local")), PrinterName("voron.local"));
  EXPECT_NE(PrinterName("localhost:7125"), PrinterName("localhost:7126"));
  EXPECT_NE(PrinterName("http://localhost/voron"), PrinterName("localhost"));
}

TEST_F(DeadRunTest, WhereADeadRunChangedToolsTheMountedToolsOffsetStays) {
  const auto path = files::JournalPath(folder_.path(), PlainAddress(address_));
  std::string kept;
  {
    RunIdentity identity{"run-1", "2026-11-22T10:00:00", address_, folder_.path()};
    identity.changes_tools = true;
    identity.without_laser = true;
    const auto guard = PrinterStateGuard::Take(session_, settings_, identity);
    ASSERT_TRUE(guard);
    kept = test::ReadWhole(path);
  }
  test::WriteWhole(path, kept);
  printer_.scripts.clear();
  printer_.state.gcode.homing_origin_mm = {0, 0, 1.5, 0};
  ASSERT_TRUE(Take("run-2"));
  EXPECT_THAT(printer_.scripts.front(), HasSubstr("Z=1.500000"));
  for (const std::string& said : said_) EXPECT_THAT(said, Not(HasSubstr("offset z")));
  EXPECT_THAT(printer_.scripts, Not(Contains("LASER_OFF")));
}

}  // namespace
}  // namespace trammel::procedure
