#include "pressure_advance/procedure/sweep_plan.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "machine/moonraker/printer.h"
#include "pressure_advance/pattern/pattern.h"
#include "pressure_advance/pattern/pattern_config.h"
#include "pressure_advance/pattern/pattern_geometry.h"
#include "pressure_advance/procedure/plate_layout.h"

namespace trammel::procedure {
namespace {

constexpr double kExact_mm = 1e-9;
constexpr double kSpeed_mm_s = 20;
const Reach kReach{{0, 0, 0}, {250, 250, 250}};

SweepPlan PlanOf(bool alternate, int at_once) {
  pressure_advance::PatternConfig pattern;
  pattern.alternate_directions = alternate;
  settings::ScanSettings settings;
  settings.lines_at_once = at_once;
  settings.scan_speed_mm_s = kSpeed_mm_s;
  const auto plan = MakePlan(LayOut(pattern), pattern, "");
  return PlanSweeps(plan, {}, settings, kReach).value();
}

// Returns the moves that a printer reports along a run, each leg from rest to rest.
std::vector<machine::TrapezoidMove> MovesAlong(std::span<const Sweep> run) {
  std::vector<machine::TrapezoidMove> moves;
  double time_s = 10;
  for (const PathLeg& leg : PathOf(run)) {
    machine::TrapezoidMove move{};
    move.print_time_s = time_s;
    move.duration_s = leg.length_mm / kSpeed_mm_s;
    move.start_velocity_mm_s = kSpeed_mm_s;
    move.start_mm = {leg.x_mm, leg.y_mm, 17.86};
    move.direction = {leg.along_x, leg.along_y, 0};
    moves.push_back(move);
    time_s += move.duration_s;
  }
  return moves;
}

TEST(SweepPath, GoesToTheNearerEndOfTheNextLineWhicheverWayThatWasPrinted) {
  for (const bool alternate : {true, false}) {
    const SweepPlan plan = PlanOf(alternate, 5);
    ASSERT_EQ(plan.runs.size(), 2u);
    const auto run = plan.Of(plan.runs[1]);
    ASSERT_EQ(run.size(), 5u);
    const auto legs = PathOf(run);
    ASSERT_EQ(legs.size(), 9u);
    for (std::size_t i = 1; i < legs.size(); i += 2) {
      EXPECT_EQ(legs[i].sweep, nullptr);
      EXPECT_NEAR(legs[i].length_mm, 4, kExact_mm) << "the lines' spacing";
    }
    const auto stretches = StretchesOf(run);
    // If all were printed one way, every other one is swept against its print.
    EXPECT_EQ(stretches[1].direction, alternate ? 1 : -1);
    for (const SweptStretch& line : stretches) {
      const double first_mm = line.PositionOf(line.begin_mm);
      const double last_mm = line.PositionOf(line.end_mm);
      EXPECT_NEAR(std::min(first_mm, last_mm), 3, kExact_mm);
      EXPECT_NEAR(std::max(first_mm, last_mm), 27, kExact_mm);
    }
  }
}

TEST(SweepPath, TurnsNoFurtherThanToTheNextLineAndRunsNoLongerThanALaserMayStayOn) {
  pressure_advance::PatternConfig pattern;
  pattern.columns = 2;
  pattern.line_count = 3;
  settings::ScanSettings settings;
  settings.lines_at_once = 100;
  auto plan = PlanSweeps(MakePlan(LayOut(pattern), pattern, ""), {}, settings, kReach).value();
  ASSERT_EQ(plan.runs.size(), 2u) << "the other pattern is too far to turn to";
  EXPECT_EQ(plan.runs[0].count, 3u);
  settings.scan_speed_mm_s = 2;  // 24 mm in 12 s
  plan = PlanSweeps(MakePlan(LayOut(pattern), pattern, ""), {}, settings, kReach).value();
  EXPECT_EQ(plan.runs.size(), 6u);
}

TEST(SweepPath, TellsTheLinesOfARunApartByTheWayThatTheHeadHasCome) {
  const SweepPlan plan = PlanOf(true, 5);
  const auto run = plan.Of(plan.runs[0]);
  machine::ClockRelation clock;
  clock.print_from_host = {0, 0, 1, 0, 0};
  const auto moves = AlongLine(MovesAlong(run), run, clock, {});
  ASSERT_EQ(moves.size(), 9u);
  const auto stretches = StretchesOf(run);
  pressure_advance::SweepTiming timing;
  for (std::size_t i = 0; i < moves.size(); ++i) {  // a frame in the middle of each
    pressure_advance::FrameTiming frame;
    frame.motion = pressure_advance::FrameMotion::kSteady;
    frame.position_mm = moves[i].start_mm + kSpeed_mm_s * moves[i].duration_s / 2;
    frame.position_sigma_mm = 0.02;
    timing.frames.push_back(frame);
  }
  for (std::size_t line = 0; line < stretches.size(); ++line) {
    const auto positions = ScoredPositions(timing, stretches[line]);
    for (std::size_t i = 0; i < positions.size(); ++i) {
      ASSERT_EQ(positions[i].has_value(), i == 2 * line) << line << ' ' << i;
    }
    EXPECT_NEAR(*positions[2 * line], 15, kExact_mm) << "the middle of a line of 30 mm";
  }
  // A frame that may have been taken in the turn has no place.
  timing.frames[2].position_mm = stretches[1].begin_mm + 0.05;
  EXPECT_FALSE(ScoredPositions(timing, stretches[1])[2]);
}

TEST(ScanTime, OfTheQuickPresetIsLessThanAThirdOfThePapers) {
  const auto total_s = [](pressure_advance::PatternPreset preset) {
    pressure_advance::PatternConfig pattern;
    settings::ScanSettings settings;
    ApplyPreset(preset, pattern, settings);
    if (preset == pressure_advance::PatternPreset::kQuick) {
      pattern = ParkedForScan(pattern, settings, kReach);
    }
    const auto layout = LayOut(pattern);
    const auto plan = PlanSweeps(MakePlan(layout, pattern, ""), {}, settings, kReach).value();
    return Summarise(layout, pattern).time_s +
           TimeOf(plan, pattern, pattern.acceleration_mm_s2, layout.moves.back().to).total_s();
  };
  const double paper_s = total_s(pressure_advance::PatternPreset::kPaper);
  EXPECT_NEAR(paper_s, 110, 1);
  EXPECT_LE(total_s(pressure_advance::PatternPreset::kQuick), paper_s / 3);
}

TEST(ParkedForScan, LeavesTheNozzleAtTheFirstSweepAndWhatSomebodyChoseAlone) {
  pressure_advance::PatternConfig pattern;
  const settings::ScanSettings settings;
  const auto parked = ParkedForScan(pattern, settings, kReach);
  const auto plan =
      PlanSweeps(MakePlan(LayOut(pattern), pattern, ""), {}, settings, kReach).value();
  const auto end = LayOut(parked).moves.back().to;
  EXPECT_NEAR(end.x_mm, plan.sweeps[0].start_x_mm, kExact_mm);
  EXPECT_NEAR(end.y_mm, plan.sweeps[0].start_y_mm, kExact_mm);
  EXPECT_NEAR(end.z_mm, settings.focus_height_mm, kExact_mm);
  EXPECT_EQ(LayOut(parked).moves.front().from.z_mm, LayOut(pattern).moves.front().from.z_mm);
  pattern.park_x_mm = 10;
  EXPECT_EQ(ParkedForScan(pattern, settings, kReach).park_y_mm, std::nullopt);
  pattern.park_x_mm.reset();
  settings::ScanSettings above = settings;  // it would ooze on the lines
  above.camera_offset_x_mm = above.camera_offset_y_mm = 0;
  EXPECT_EQ(ParkedForScan(pattern, above, kReach).park_x_mm, std::nullopt);
}

using ::testing::HasSubstr;
using ::testing::Not;

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

// The laser meets the plate at nozzle + (28, 50.2); 4 mm are skipped and 1 mm is run-up.
TEST(SweepPlan, TheLaserRunsAlongTheLineWhicheverWayItWasPrinted) {
  const auto first = PlanSweeps(OneLine(100, 120, 130, 120), 0, {}, kReach);
  ASSERT_TRUE(first.has_value()) << first.error().message;
  EXPECT_NEAR(first->sweeps.front().start_x_mm, 100 + 3 - 28, kExact_mm);
  EXPECT_NEAR(first->sweeps.front().start_y_mm, 120 - 50.2, kExact_mm);
  for (const auto& line :
       {OneLine(100, 120, 130, 120), OneLine(130, 120, 100, 120), OneLine(100, 120, 100, 150)}) {
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
  settings::ScanSettings settings;
  settings.focus_height_mm = 300;
  const auto high = PlanSweeps(OneLine(100, 120, 130, 120), 0, settings, kReach);
  ASSERT_FALSE(high.has_value());
  EXPECT_EQ(high.error().kind, ErrorKind::kSafety);
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
  // Whatever override of the speed was left over.
  EXPECT_LT(text.find("M220 S100\n"), text.find("\nG1 X"));
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
