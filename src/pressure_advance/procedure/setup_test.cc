// What keeps a set-up from beginning; what it does on a machine is shown in camera_setup_test.
#include "pressure_advance/procedure/setup.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <string>

#include "session/fake_printer.h"
#include "support/temporary_folder.h"

namespace trammel::procedure {
namespace {

using ::testing::AllOf;
using ::testing::HasSubstr;

class SetUpCameraTest : public ::testing::Test {
 protected:
  SetUpCameraTest() {
    request_.pattern.material = "pla";
    request_.clear = {12, 25};
    request_.run = "run-1";
    request_.folder = folder_.path();
    request_.state_folder = folder_.path();
  }
  // REQUIRES that it cannot begin.
  Error Refusal() {
    const auto outcome = SetUpCamera({printer_, {}, {}}, request_);
    EXPECT_FALSE(outcome.done);
    EXPECT_EQ(outcome.record.result.verdict(), Verdict::kRefused);
    const bool moved = std::ranges::any_of(printer_.scripts, [](const std::string& script) {
      return script.find("G1") != std::string::npos || script.find("G28") != std::string::npos ||
             script.find("M104") != std::string::npos || script == "_LASER_ON";
    });
    EXPECT_FALSE(moved) << "moved, heated or lit before it was refused";
    return outcome.done ? Error{} : outcome.done.error();
  }
  testing::FakePrinter printer_;
  test::TemporaryFolder folder_;
  SetupRequest request_;
};

TEST_F(SetUpCameraTest, NothingIsHeatedWithoutAMaterial) {
  request_.pattern.material.clear();
  EXPECT_THAT(Refusal().message, HasSubstr("material"));
}

TEST_F(SetUpCameraTest, APrinterThatPrintsSomethingIsLeftAlone) {
  printer_.state.print_state = "printing";
  printer_.state.print_file = "vase.gcode";
  const Error error = Refusal();
  EXPECT_EQ(error.kind, ErrorKind::kMachine);
  EXPECT_THAT(error.message, AllOf(HasSubstr("busy"), HasSubstr("vase.gcode")));
}

TEST_F(SetUpCameraTest, ALaserThatCannotBeSwitchedOffIsNeverSwitchedOn) {
  request_.settings.laser_off_gcode.clear();
  EXPECT_THAT(Refusal().message, HasSubstr("laser_off_gcode"));
}

TEST_F(SetUpCameraTest, TooSmallAClearRangeIsNamed) {
  request_.clear = {16, 20};
  EXPECT_THAT(Refusal().message, HasSubstr("--clear-z 16,20: leaves 3.00 mm"));
}

TEST_F(SetUpCameraTest, AMarkOutsideOfTheBedOrTheHeadsReachIsASafetyMatter) {
  request_.mark = {245, 245};
  EXPECT_EQ(Refusal().kind, ErrorKind::kSafety);
  request_.mark = {20, 150};  // the nozzle would have to stand at x = -8 mm to look at it
  const Error error = Refusal();
  EXPECT_EQ(error.kind, ErrorKind::kSafety);
  EXPECT_THAT(error.message, HasSubstr("--mark-at"));
}

TEST_F(SetUpCameraTest, ACameraThatIsNotThereIsNamedBeforeAnythingMoves) {
  EXPECT_THAT(Refusal().message, HasSubstr("lists no camera"));
}

}  // namespace
}  // namespace trammel::procedure
