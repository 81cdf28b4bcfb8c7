#include "pressure_advance/procedure/sweep_plan.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "pressure_advance/pattern/pattern.h"
#include "pressure_advance/pattern/pattern_presets.h"
#include "pressure_advance/procedure/sweep_path.h"

namespace trammel::procedure {
namespace {

using ::testing::HasSubstr;
using ::testing::Not;

constexpr double kExact_mm = 1e-9;

pressure_advance::PatternPlan OneLine(double start_x, double start_y, double end_x, double end_y) {
  pressure_advance::PatternPlan plan;
  plan.line_length_mm = 30;
  plan.lines = {{0, 0.02, start_x, start_y, end_x, end_y}};
  return plan;
}

// Several lines in one go, as the default pattern is scanned.
settings::ScanSettings ScanPresetSettings() {
  settings::ScanSettings settings;
  settings.scan_speed_mm_s = 20;
  settings.lines_at_once = 5;
  return settings;
}

const Reach kReach{{0, 0, 0}, {250, 250, 250}};

TEST(SweepPlan, TheLaserRunsAlongTheLineFromRunUpToRunUp) {
  // The laser meets the plate at nozzle + (28, 50.2); 4 mm are skipped and 1 mm is run-up.
  const auto plan = PlanSweeps(OneLine(100, 120, 130, 120), 0, {}, kReach);
  ASSERT_TRUE(plan.has_value()) << plan.error().message;
  const Sweep& sweep = plan->sweeps.front();
  EXPECT_NEAR(sweep.start_x_mm, 100 + 3 - 28, kExact_mm);
  EXPECT_NEAR(sweep.end_x_mm, 130 - 3 - 28, kExact_mm);
  EXPECT_NEAR(sweep.start_y_mm, 120 - 50.2, kExact_mm);
  EXPECT_NEAR(sweep.PositionOf(sweep.start_x_mm, sweep.start_y_mm), 3, kExact_mm);
  EXPECT_NEAR(sweep.PositionOf(sweep.end_x_mm, sweep.end_y_mm), 27, kExact_mm);
}

TEST(SweepPlan, FollowsLinesPrintedTheOtherWayAndAcross) {
  for (const auto& line : {OneLine(130, 120, 100, 120), OneLine(100, 120, 100, 150)}) {
    const auto plan = PlanSweeps(line, 0, {}, kReach);
    ASSERT_TRUE(plan.has_value()) << plan.error().message;
    const Sweep& sweep = plan->sweeps.front();
    EXPECT_NEAR(sweep.PositionOf(sweep.start_x_mm, sweep.start_y_mm), 3, kExact_mm);
    EXPECT_NEAR(sweep.PositionOf(sweep.end_x_mm, sweep.end_y_mm), 27, kExact_mm);
  }
}

TEST(SweepPlan, RefusesToLeaveTheBedAndNamesLineAxisAndBound) {
  const auto plan = PlanSweeps(OneLine(10, 120, 40, 120), 0, {}, kReach);
  ASSERT_FALSE(plan.has_value());
  EXPECT_EQ(plan.error().kind, ErrorKind::kSafety);
  EXPECT_THAT(plan.error().message, HasSubstr("X = -15.00 mm"));
  EXPECT_THAT(plan.error().message, HasSubstr("0.00 ... 250.00 mm"));
}

TEST(SweepPlan, RefusesAFocusHeightThatTheHeadCannotReach) {
  settings::ScanSettings settings;
  settings.focus_height_mm = 300;
  const auto plan = PlanSweeps(OneLine(100, 120, 130, 120), 0, settings, kReach);
  ASSERT_FALSE(plan.has_value());
  EXPECT_EQ(plan.error().kind, ErrorKind::kSafety);
}

TEST(SweepPlan, RefusesASkipThatLeavesNothing) {
  settings::ScanSettings settings;
  settings.skip_mm = 15;
  const auto plan = PlanSweeps(OneLine(100, 120, 130, 120), 0, settings, kReach);
  ASSERT_FALSE(plan.has_value());
  EXPECT_EQ(plan.error().kind, ErrorKind::kInput);
}

TEST(SweepPlan, RefusesASkipOrASpeedThatLeavesTooLittleToCompareALineWith) {
  pressure_advance::PatternConfig config;
  settings::ScanSettings settings;
  ApplyPreset(pressure_advance::PatternPreset::kQuick, config, settings);
  const auto plan = MakePlan(LayOut(config), config, "pattern.gcode");
  settings::ScanSettings slow_camera = settings;
  slow_camera.frames_per_s = 15;
  const auto few = PlanSweeps(plan, 0, slow_camera, kReach);
  ASSERT_FALSE(few.has_value());
  EXPECT_EQ(few.error().kind, ErrorKind::kInput);
  EXPECT_THAT(few.error().message, HasSubstr("[scan] speed = 20 mm/s is too fast"));
  slow_camera.scan_speed_mm_s = 10;
  EXPECT_TRUE(PlanSweeps(plan, 0, slow_camera, kReach).has_value());
  settings.skip_mm = 4;
  const auto skipped = PlanSweeps(plan, 0, settings, kReach);
  ASSERT_FALSE(skipped.has_value());
  EXPECT_THAT(skipped.error().message, HasSubstr("leaves out where a line speeds up"));
}

TEST(SweepPlan, TheDefaultPatternFitsADefaultBed) {
  const pressure_advance::PatternConfig config;
  const auto plan = MakePlan(LayOut(config), config, "pattern.gcode");
  const auto sweeps = PlanSweeps(plan, 0, {}, kReach);
  ASSERT_TRUE(sweeps.has_value()) << sweeps.error().message;
  EXPECT_EQ(sweeps->sweeps.size(), 10u);
}

TEST(SweepPlan, TheCornersOfARoundReachAreOutOfReach) {
  const Reach square{{-120, -120, 0}, {120, 120, 300}};
  Reach round = square;
  round.round = true;
  settings::ScanSettings above;
  above.camera_offset_x_mm = above.camera_offset_y_mm = 0;
  const auto corner = OneLine(70, 100, 100, 100);
  ASSERT_TRUE(PlanSweeps(corner, 0, above, square).has_value());
  const auto refused = PlanSweeps(corner, 0, above, round);
  ASSERT_FALSE(refused.has_value());
  EXPECT_EQ(refused.error().kind, ErrorKind::kSafety);
  EXPECT_THAT(refused.error().message, HasSubstr("in a circle"));
  EXPECT_TRUE(PlanSweeps(OneLine(-15, 100, 15, 100), 0, above, round).has_value());
}

TEST(SweepPlan, TheDryRunSwitchesTheLaserOffAtTheEnd) {
  const auto plan = PlanSweeps(OneLine(100, 120, 130, 120), 0, {}, kReach);
  ASSERT_TRUE(plan.has_value());
  const std::string text = DescribeSweeps(*plan, {}, 150);
  EXPECT_THAT(text.substr(text.size() - 10), HasSubstr("LASER_OFF"));
  EXPECT_THAT(text, Not(HasSubstr("nan")));
}

TEST(SweepPlan, SweepsRunAtTheirSpeedWhateverOverrideWasLeftOver) {
  const auto plan = PlanSweeps(OneLine(100, 120, 130, 120), 0, {}, kReach);
  ASSERT_TRUE(plan.has_value());
  const std::string text = DescribeSweeps(*plan, {}, 150);
  EXPECT_LT(text.find("M220 S100\n"), text.find("\nG1 X"));
  EXPECT_EQ(FocusGcode(17, 5), "G90\nM220 S100\nG1 Z17.000 F300");
}

// The printer's own limit switches the laser off after 30 s, however slow the sweep.
TEST(SweepPlan, CutsARunSoThatASlowerSweepKeepsTheLaserLitNoLonger) {
  constexpr double kLongest_s = 20;
  const auto config = pressure_advance::PatternConfig{};
  const auto plan =
      PlanSweeps(MakePlan(LayOut(config), config, "p.gcode"), 0, ScanPresetSettings(), kReach);
  ASSERT_TRUE(plan.has_value()) << plan.error().message;
  const SweepRun whole = plan->runs.front();
  ASSERT_GT(whole.count, 1U);
  for (const double speed_mm_s : {20.0, 10.0, 5.0, 1.0, 0.1}) {
    std::size_t lines = 0, parts = 0;
    for (SweepRun rest = whole; rest.count > 0; ++parts) {
      const SweepRun part = plan->FirstPartOf(rest, speed_mm_s);
      ASSERT_GE(part.count, 1U);
      EXPECT_EQ(part.first, rest.first);
      const auto legs = PathOf(plan->Of(part));
      const double way_mm = legs.back().begin_mm + legs.back().length_mm - legs.front().begin_mm;
      if (part.count > 1) EXPECT_LE(way_mm / speed_mm_s, kLongest_s) << speed_mm_s;
      lines += part.count;
      rest = {rest.first + part.count, rest.count - part.count};
    }
    EXPECT_EQ(lines, whole.count);
    if (speed_mm_s == plan->speed_mm_s) EXPECT_EQ(parts, 1U);
  }
}

}  // namespace
}  // namespace trammel::procedure
