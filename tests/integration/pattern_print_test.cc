// The pattern's file as the virtual printer understands it: two readings that share no code.
#include <gtest/gtest.h>

#include <cmath>
#include <numbers>
#include <string>

#include "pressure_advance/pattern/pattern.h"
#include "sim/print/gcode_interpreter.h"
#include "sim/print/planner.h"

namespace trammel {
namespace {

using pressure_advance::PatternConfig;

std::vector<sim::TimedMove> PlanOf(const PatternConfig& config) {
  const std::string gcode = WriteGcode(LayOut(config), config);
  const auto program = sim::InterpretGcode(gcode, {});
  EXPECT_TRUE(program) << program.error().message;
  return sim::PlanMotion(program->moves);
}

double SummarisedTime_s(const PatternConfig& config) {
  return Summarise(LayOut(config), config).time_s;
}

TEST(PatternPrint, TakesTheTimeThatTheSummaryPromises) {
  // Two files that differ by 90 lines and nine frames; the way from homing, which only the printer
  // knows, is in both.
  PatternConfig one;
  one.material = "abs";
  one.bed_size_x_mm = one.bed_size_y_mm = 350;
  one.position_x_mm = 10;
  one.position_y_mm = 10;
  PatternConfig ten = one;
  ten.columns = 5;
  ten.rows = 2;
  const double promised_s = SummarisedTime_s(ten) - SummarisedTime_s(one);
  const double planned_s = PlanOf(ten).back().end_s() - PlanOf(one).back().end_s();
  // Coordinates rounded to 1 um and feeds to 0.01 mm/min are far below this; what remains is the
  // planner's rounding of corners by the filament's own limit at the frames' corners.
  constexpr double kRelative = 0.002;
  EXPECT_NEAR(planned_s, promised_s, kRelative * promised_s);
}

TEST(PatternPrint, ReachesTheFastSpeedOnEveryLineAndDepositsWhatWasPromised) {
  PatternConfig config;
  config.material = "abs";
  const auto summary = Summarise(LayOut(config), config);
  int fast = 0;
  double filament_mm = 0;
  for (const sim::TimedMove& move : PlanOf(config)) {
    filament_mm += move.move.e_mm;
    if (!move.deposits() || std::abs(move.move.feed_mm_s - 150) > 1e-6) continue;
    ++fast;
    EXPECT_NEAR(move.cruise_v_mm_s, 150, 1e-6);
    EXPECT_NEAR(move.start_v_mm_s, 5, 1e-6);
    EXPECT_NEAR(move.end_v_mm_s, 5, 1e-6);
    EXPECT_GT(move.cruise_s, 0);
  }
  EXPECT_EQ(fast, 10);
  EXPECT_NEAR(filament_mm, summary.filament_mm, 1e-5);  // E is written to 1e-5 mm
}

TEST(PatternPrint, UsesNoCommandThatTheVirtualPrinterDoesNotKnowInAnyDialect) {
  for (const gcode::FirmwareWords& words : gcode::Firmwares()) {
    PatternConfig config;
    config.material = "abs";
    config.dialect = words.dialect;
    config.start_gcode = words.start_gcode;
    config.end_gcode = words.end_gcode;
    const auto program = sim::InterpretGcode(WriteGcode(LayOut(config), config), {});
    ASSERT_TRUE(program) << program.error().message;
    for (const auto& [name, count] : program->ignored) {
      ADD_FAILURE() << words.name << ": " << name << " (" << count << ")";
    }
    EXPECT_EQ(program->hottest_nozzle_c, 255);
  }
}

}  // namespace
}  // namespace trammel
