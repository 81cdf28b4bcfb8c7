#include "session/own_print.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "session/fake_printer.h"

namespace trammel::procedure {
namespace {

using ::testing::AllOf;
using ::testing::ElementsAre;
using ::testing::HasSubstr;
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

TEST_F(OwnPrint, IsCancelledAndTheNozzleLiftedOffItAndParked) {
  const EndedPrint ended = End();
  EXPECT_THAT(ended.failed, IsEmpty());
  EXPECT_THAT(ended.lost, IsEmpty());
  EXPECT_THAT(
      printer_.scripts,
      ElementsAre("CANCEL_PRINT", "G91\nG1 Z20.000 F300\nG1 X-95.000 Y-114.000 F9000\nG90\nM400"));
}

// Without [pause_resume] Moonraker's own call fails, and there is no CANCEL_PRINT.
TEST_F(OwnPrint, IsEndedByClosingItsFileWhereNothingCanCancelIt) {
  printer_.cannot_cancel = true;
  EXPECT_THAT(End().failed, IsEmpty());
  EXPECT_THAT(printer_.scripts,
              ElementsAre("CANCEL_PRINT", "SDCARD_RESET_FILE", HasSubstr("G91\nG1 Z20.000")));
}

TEST_F(OwnPrint, ThatNothingEndsIsSaidToGoOnAndIsNotLiftedOff) {
  printer_.cannot_cancel = true;
  printer_.refused["SDCARD_RESET_FILE"] = "no";
  EXPECT_THAT(End().failed,
              ElementsAre(AllOf(HasSubstr("it goes on"), HasSubstr("cancel it at the printer"))));
  EXPECT_THAT(printer_.scripts, ElementsAre("CANCEL_PRINT", "SDCARD_RESET_FILE"));
}

TEST_F(OwnPrint, LiftsNoHigherThanTheAxisGoes) {
  printer_.state.print_state = "error";
  printer_.state.position_mm = {5, 6, 245, 7};
  EXPECT_THAT(End().failed, IsEmpty());
  EXPECT_THAT(printer_.scripts, ElementsAre(HasSubstr("G1 Z5.000 F300\nG1 X0.000 Y0.000")));
}

TEST_F(OwnPrint, SaysSoWhereTheNozzleCannotBeLiftedBecauseNothingIsHomed) {
  printer_.state.homed_axes = "";
  EXPECT_THAT(End().lost, ElementsAre(HasSubstr("could not be lifted")));
  EXPECT_THAT(printer_.scripts, ElementsAre("CANCEL_PRINT"));
}

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
