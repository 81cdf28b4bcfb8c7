#include "session/print.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "session/fake_printer.h"
#include "support/matchers.h"

namespace trammel::procedure {
namespace {

using ::testing::AllOf;
using ::testing::HasSubstr;

class PrintTest : public ::testing::Test {
 protected:
  std::string HeatError() { return ErrorOf(HeatAndWait(session_, "heater_bed", 60, 900)); }

  testing::FakePrinter printer_;
  const Session session_{printer_, {}, {}};
};

// It tells of the restart while somebody waits to see whether it is idle.
class RestartingPrinter : public testing::FakePrinter {
 public:
  Result<machine::PrinterState> WaitUntil(
      const std::function<bool(const machine::PrinterState&)>& done, std::string_view what,
      const machine::WaitLimit& limit) override {
    if (what == "the printer to be idle") {
      state.readiness = machine::PrinterReadiness::kDisconnected;
      state.message = "Klipper restarts";
    }
    return FakePrinter::WaitUntil(done, what, limit);
  }
};

TEST_F(PrintTest, ARestartWhileItHeatsIsNobodysCooldown) {
  RestartingPrinter restarting;
  restarting.state.heaters["heater_bed"] = {26, 0};
  EXPECT_THAT(HeatAndWait({restarting, {}, {}}, "heater_bed", 60, 900),
              FailsWith("disconnected", "Klipper restarts"));
}

// PRINT_START heats by itself, and a run that dies then has to know it.
TEST_F(PrintTest, WhatTheFilesOwnMacrosHeatIsNotedAsItComes) {
  std::string noted;
  Session session = session_;
  session.own_file = "trammel_run-1.gcode";
  session.note = [&](std::string_view gcode) {
    noted += gcode;
    return Result<void>();
  };
  printer_.state.print_file = session.own_file;
  printer_.state.print_state = "complete";
  printer_.state.heaters["extruder"].target_c = 231;
  ASSERT_TRUE(Print(session, "PRINT_START\n", {}));
  EXPECT_THAT(noted, AllOf(HasSubstr("PRINT_START"),
                           HasSubstr("SET_HEATER_TEMPERATURE HEATER=extruder TARGET=231")));
}

TEST(PrintProgress, IsWhatThePrinterDoesNotHowFarItHasRead) {
  machine::PrinterState state;
  state.print_progress = 0.06;
  state.heaters["extruder"] = {143, 215};
  state.heaters["heater_bed"] = {60, 60};
  EXPECT_EQ(ProgressOfPrint(state, 200).text, "  heating extruder: 143 of 215 degC");
  EXPECT_EQ(ProgressOfPrint(state, 200).done, 0);
  state.heaters["extruder"].temperature_c = 214;
  EXPECT_EQ(ProgressOfPrint(state, 200).text, "  at the start G-code");
  state.print_filament_mm = 50;
  EXPECT_EQ(ProgressOfPrint(state, 200).text, "  25 % printed");
  EXPECT_EQ(ProgressOfPrint(state, 0).text, "  6 % printed") << "of a file that nobody knows";
  state.print_filament_mm = 230;
  EXPECT_EQ(ProgressOfPrint(state, 200).done, 1) << "the start G-code primes, too";
}

using ::testing::ElementsAre;
using ::testing::IsEmpty;

constexpr const char* kOwnFile = "trammel_run-1.gcode";
constexpr ParkPlace kPark{20, 5, 6, 5, 150};

class OwnPrint : public ::testing::Test {
 protected:
  void SetUp() override {
    printer_.state.print_state = "printing";
    printer_.state.print_file = kOwnFile;
    printer_.state.position_mm = {100, 120, 0.2, 7};
  }
  EndedPrint End(const std::optional<ParkPlace>& park = kPark) {
    const machine::PrinterState now = printer_.state;
    return EndOwnPrint({printer_, {}, {}, false, "", kOwnFile}, now, park);
  }

  testing::FakePrinter printer_;
};

TEST_F(OwnPrint, SaysSoWhereTheNozzleIsNotLiftedBecauseThePrinterShutDown) {
  printer_.state.readiness = machine::PrinterReadiness::kShutdown;
  printer_.state.message = "MCU lost";
  const EndedPrint ended = End();
  EXPECT_THAT(ended.failed, ElementsAre(AllOf(HasSubstr("has shut down"), HasSubstr("MCU lost"),
                                              HasSubstr("FIRMWARE_RESTART"))));
  EXPECT_THAT(ended.lost,
              ElementsAre(AllOf(HasSubstr("could not be lifted"), HasSubstr("MCU lost"))));
}

TEST_F(OwnPrint, LeavesACompletePrintAndAnothersJobAlone) {
  printer_.state.print_state = "complete";
  EXPECT_THAT(End().failed, IsEmpty());
  printer_.state.print_state = "printing";
  printer_.state.print_file = "vase.gcode";
  EXPECT_THAT(End().failed, IsEmpty());
  EXPECT_THAT(printer_.scripts, IsEmpty());
}

}  // namespace
}  // namespace trammel::procedure
