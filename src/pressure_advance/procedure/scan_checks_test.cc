#include "pressure_advance/procedure/scan_checks.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <string>

#include "pressure_advance/pattern/pattern_config.h"
#include "session/fake_printer.h"

namespace trammel::procedure {
namespace {

using ::testing::AllOf;
using ::testing::HasSubstr;

class ScanChecks : public ::testing::Test {
 protected:
  ScanChecks() {
    ApplyPreset(pressure_advance::kDefaultPreset, pattern_);
    pattern_.material = "pla";
    printer_.state.axis_minimum_mm = {0, 0, -2};
  }
  /// Returns why the pattern is not printed; empty if it is.
  [[nodiscard]] std::string Refusal() {
    const auto may =
        FirstFailure(CheckForPrint({printer_, {}, {}}, {pattern_}), ErrorKind::kMachine);
    if (may) return "";
    EXPECT_EQ(may.error().kind, ErrorKind::kSafety) << may.error().message;
    return may.error().message;
  }
  nlohmann::json& Settings() { return printer_.told["configfile"]["settings"]; }

  testing::FakePrinter printer_;
  pressure_advance::PatternConfig pattern_;
};

// SET_GCODE_OFFSET moves the pattern with all its coordinates.
TEST_F(ScanChecks, RefuseAPatternThatAnOffsetMovesOutOfReach) {
  printer_.state.gcode.homing_origin_mm = {0, 120, 0, 0};
  EXPECT_THAT(Refusal(), AllOf(HasSubstr("the pattern covers"), HasSubstr("Y -120.0 ... 130.0"),
                               HasSubstr("G-code offset 0, 120, 0 mm")));
  printer_.state.gcode.homing_origin_mm = {0, 60, 0, 0};
  EXPECT_EQ(Refusal(), "");
  pattern_.park_y_mm = 200;  // 260 mm of the toolhead
  EXPECT_THAT(Refusal(), HasSubstr("is to wait at"));
}

TEST_F(ScanChecks, RefuseHeightsBeyondTheAxis) {
  printer_.state.axis_maximum_mm[2] = 15;  // it parks at 20.25
  EXPECT_THAT(Refusal(), AllOf(HasSubstr("Z = 0.25 ... 20.25 mm"), HasSubstr("park_lift")));
  pattern_.park_lift_mm = 10;
  EXPECT_EQ(Refusal(), "");
  printer_.state.axis_minimum_mm[2] = 0;
  printer_.state.gcode.homing_origin_mm = {0, 0, -0.4, 0};  // 0.25 - 0.4 mm
  EXPECT_THAT(Refusal(), HasSubstr("with the G-code offset -0.4 mm"));
}

TEST_F(ScanChecks, RefuseLinesThatAPolarPrinterCannotTurnFastEnough) {
  Settings()["printer"] = {{"kinematics", "polar"},
                           {"max_velocity", 300},
                           {"max_accel", 5000},
                           {"max_angular_velocity", 10}};
  printer_.state.axis_minimum_mm = {-125, -125, 0};
  printer_.state.axis_maximum_mm = {125, 125, 250};
  pattern_.bed_shape = settings::BedShape::kEllipse;
  pattern_.bed_origin_x_mm = pattern_.bed_origin_y_mm = -125;
  EXPECT_THAT(Refusal(), AllOf(HasSubstr("max_angular_velocity of [printer]"),
                               HasSubstr("9 mm off the centre")));
  pattern_.position_y_mm = 15;  // nearest line 17.5 mm off
  EXPECT_EQ(Refusal(), "");
  Settings()["printer"]["kinematics"] = "corexy";
  pattern_.position_y_mm.reset();
  EXPECT_EQ(Refusal(), "");
}

}  // namespace
}  // namespace trammel::procedure
