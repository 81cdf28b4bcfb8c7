#include "tool_offset/sheet/sheet_validate.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <functional>
#include <limits>
#include <numbers>
#include <string>

#include "tool_offset/sheet/sheet_bed.h"
#include "tool_offset/sheet/sheet_plan.h"
#include "tool_offset/sheet/sheet_settings.h"

namespace trammel::tool_offset {
namespace {

using ::testing::HasSubstr;
using ::testing::IsEmpty;

std::string ProblemAfter(const std::function<void(SheetSettings&)>& change) {
  SheetSettings settings;
  change(settings);
  const auto problem = FindProblem(settings);
  return problem ? problem->key + ": " + problem->message : "";
}

TEST(SheetValidate, DefaultsAreGoodAndWarnOfNothing) {
  EXPECT_EQ(ProblemAfter([](SheetSettings&) {}), "");
  EXPECT_THAT(FindWarnings(SheetSettings{}), IsEmpty());
}

TEST(SheetValidate, EachFaultIsNamedWithItsBound) {
  const struct {
    const char* says;
    void (*change)(SheetSettings&);
  } faults[] = {
      {"tools: 0 tool(s)", [](SheetSettings& s) { s.tools = {}; }},
      {"self_test", [](SheetSettings& s) { s.tools = {0}; }},
      {"tools: 1 stands twice",
       [](SheetSettings& s) {
         s.tools = {0, 1, 1};
       }},
      {"reference_tool: 0 is not among tools = [1, 2]",
       [](SheetSettings& s) {
         s.tools = {1, 2};
       }},
      {"2 ... 8", [](SheetSettings& s) { s.tools = {0, 1, 2, 3, 4, 5, 6, 7, 8}; }},
      {"tools: -1 is outside 0 ... 31",
       [](SheetSettings& s) {
         s.tools = {0, -1};
       }},
      {"has one", [](SheetSettings& s) { s.self_test = true; }},
      {"pick_ups",
       [](SheetSettings& s) {
         s.self_test = true;
         s.tools = {0};
         s.pick_ups = 1;
       }},
      {"nozzle_temperatures: 1 value(s) for 2 tool(s)",
       [](SheetSettings& s) { s.nozzle_temperatures_c = {200}; }},
      {"overlap: 6 mm is above 5 mm", [](SheetSettings& s) { s.overlap_mm = 6; }},
      {"pitch: 2.5 mm leaves 0.100 mm", [](SheetSettings& s) { s.pitch_mm = 2.5; }},
      {"would merge", [](SheetSettings& s) { s.leg_spacing_mm = 0.35; }},
      {"tilt: 3°", [](SheetSettings& s) { s.tilt_deg = 3; }},
      {"run_in: 2 mm is below 2.3 mm", [](SheetSettings& s) { s.tilt_deg = 5; }},
      {"take 4", [](SheetSettings& s) { s.controls = 3; }},
      {"z_hop: 0 mm is below 0.2 mm", [](SheetSettings& s) { s.printer.z_hop_mm = 0; }},
      {"layer_height", [](SheetSettings& s) { s.layer_height_mm = 0.5; }},
      {"names neither {tool} nor {extruder}", [](SheetSettings& s) { s.tool_change_gcode = "T1"; }},
      {"unknown placeholder {tol}", [](SheetSettings& s) { s.tool_change_gcode = "T{tol}"; }},
      {"start_gcode", [](SheetSettings& s) { s.start_gcode = "T{tool}"; }},
      {"position_x: the sheet for 2 tool(s)", [](SheetSettings& s) { s.position_x_mm = 40; }},
      {"fits without position_x", [](SheetSettings& s) { s.position_x_mm = 40; }},
  };
  for (const auto& fault : faults) EXPECT_THAT(ProblemAfter(fault.change), HasSubstr(fault.says));
}

TEST(SheetValidate, WhatPitchIsAdvisedIsTaken) {
  SheetSettings settings;
  settings.pitch_mm = 2.5;
  const auto problem = FindProblem(settings);
  ASSERT_TRUE(problem);
  const std::string& message = problem->message;
  settings.pitch_mm = std::stod(message.substr(message.find("take ") + 5));
  EXPECT_FALSE(FindProblem(settings));
}

TEST(SheetValidate, NoNumberThatIsNotOneGetsThrough) {
  for (const SheetField& field : SheetFields()) {
    for (const double value : {std::numeric_limits<double>::quiet_NaN(),
                               std::numeric_limits<double>::infinity(), -1e300, 1e300}) {
      SheetSettings settings;
      if (const auto* number = std::get_if<double SheetSettings::*>(&field.member)) {
        settings.*(*number) = value;
        const auto problem = FindProblem(settings);
        ASSERT_TRUE(problem) << field.key;
        EXPECT_EQ(problem->key, field.key);
      }
    }
  }
}

TEST(SheetValidate, ASheetThatLeavesTheBedIsRefusedWithWhatWouldFit) {
  const std::string small = ProblemAfter([](SheetSettings& s) {
    s.printer.bed_size_x_mm = 155;
    s.printer.bed_size_y_mm = 155;
  });
  EXPECT_THAT(small, HasSubstr("reaches x ="));
  EXPECT_THAT(small, HasSubstr("teeth = "));
  const std::string many = ProblemAfter([](SheetSettings& s) {
    s.tools = {0, 1, 2, 3, 4, 5, 6, 7};
    s.teeth = 30;
  });
  EXPECT_THAT(many, HasSubstr("would fit"));
  EXPECT_EQ(ProblemAfter([](SheetSettings& s) {
              s.tools = {0, 1, 2, 3, 4, 5, 6, 7};
              s.printer.bed_size_x_mm = 300;
              s.printer.bed_size_y_mm = 300;
            }),
            "");
}

TEST(SheetValidate, ARoundBedHoldsNoCorners) {
  SheetSettings settings;
  settings.printer.bed_shape = settings::BedShape::kEllipse;
  const SheetPlan plan = PlanSheet(settings);
  double radius_mm = 0;
  for (const BedPoint& corner : SheetCorners(settings, plan.width_mm, plan.height_mm)) {
    radius_mm = std::max(radius_mm, std::hypot(corner.x_mm - 125, corner.y_mm - 125));
  }
  EXPECT_NEAR(SheetReach(settings, plan.width_mm, plan.height_mm), radius_mm / 120, 1e-9);
  EXPECT_FALSE(FindProblem(settings));
}

/// Combs drawn with a periodic error of both motors, one after the other, at every phase: the
/// largest difference between their means. Told anew, leg by leg.
double WorstOffset(double pitch_mm, int teeth, double tilt_deg, double period_mm, bool core_xy) {
  const double t = tilt_deg * std::numbers::pi / 180;
  double worst = 0;
  for (int motor = 0; motor < 2; ++motor) {
    for (int phase = 0; phase < 64; ++phase) {
      double mean[2] = {0, 0};
      for (int comb = 0; comb < 2; ++comb) {
        for (int tooth = 0; tooth < teeth; ++tooth) {
          const double u_mm = pitch_mm * (tooth + comb / 2.0);
          const double x_mm = u_mm * std::cos(t);
          const double y_mm = u_mm * std::sin(t);
          const double at_mm =
              core_xy ? (motor == 0 ? x_mm + y_mm : x_mm - y_mm) : (motor == 0 ? x_mm : y_mm);
          const double error = std::sin(2 * std::numbers::pi * (at_mm / period_mm + phase / 64.0));
          const double dx = core_xy ? error / 2 : motor == 0 ? error : 0;
          const double dy = core_xy      ? (motor == 0 ? error / 2 : -error / 2)
                            : motor == 0 ? 0
                                         : error;
          mean[comb] += (dx * std::cos(t) + dy * std::sin(t)) / teeth;
        }
      }
      worst = std::max(worst, std::abs(mean[1] - mean[0]));
    }
  }
  return worst;
}

TEST(SheetPitch, TheDefaultLeavesLessThanATenthOfAPeriodicMotorError) {
  const SheetSettings settings;
  double worst = 0;
  for (const double period_mm : {2.0, 0.8, 0.64, 0.4, 0.32, 0.2}) {
    for (const bool core_xy : {false, true}) {
      worst = std::max(worst, WorstOffset(settings.pitch_mm, settings.teeth, settings.tilt_deg,
                                          period_mm, core_xy));
    }
  }
  EXPECT_LT(worst, 0.1);
  // The closed form and the drawn combs agree; 64 phases miss a peak by 1 - cos(pi / 64).
  EXPECT_NEAR(MotorErrorShare(settings.pitch_mm, settings.teeth, settings.tilt_deg), worst, 2e-3);
}

TEST(SheetPitch, APitchThatLocksIsWarnedOfWithTheNearestGoodOne) {
  SheetSettings settings;
  settings.pitch_mm = 3.7;  // turned by 15°, half of it is 1.5 cycles of 0.32 mm along y
  EXPECT_GT(MotorErrorShare(3.7, 17, 15), 0.4);
  EXPECT_THAT(FindWarnings(settings), testing::ElementsAre(HasSubstr("pitch = 3.7 mm locks")));
  settings.pitch_mm = NearestGoodPitch_mm(3.7, 17, 15);
  EXPECT_THAT(FindWarnings(settings), IsEmpty());
  EXPECT_LT(std::abs(settings.pitch_mm - 3.7), 1);
}

}  // namespace
}  // namespace trammel::tool_offset
