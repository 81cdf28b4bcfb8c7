#include "pressure_advance/pattern/pattern.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <numbers>

#include "gcode/bead.h"
#include "pressure_advance/pattern/pattern_config.h"
#include "pressure_advance/pattern/pattern_geometry.h"

namespace trammel::pressure_advance {
namespace {

TEST(Pattern, ExtrudesThePapersFilamentPerMillimetre) {
  // The paper's code drives 0.045899 mm of filament per mm; 0.495 mm is that figure turned into a
  // width and rounded to 1 um: up to 0.0005 mm * 0.25 mm / 2.405 mm^2 = 5.2e-5.
  constexpr double kRounding = 5.2e-5;
  EXPECT_NEAR(FilamentPerMm(PatternConfig{}), 0.045899, kRounding);
}

TEST(Pattern, LiesWhereItsPositionSaysWhateverTheBedsOrigin) {
  PatternConfig config;
  config.bed_origin_x_mm = -125;
  config.bed_origin_y_mm = -125;
  const BoundsMm centred = LayOut(config).printed;
  constexpr double kRounding_mm = 1e-9;
  EXPECT_NEAR(centred.min_x_mm + centred.max_x_mm, 0, kRounding_mm);
  EXPECT_NEAR(centred.min_y_mm + centred.max_y_mm, 0, kRounding_mm);
  config.position_x_mm = -100;
  config.position_y_mm = 20;
  ASSERT_TRUE(Validate(config));
  EXPECT_EQ(LayOut(config).printed.min_x_mm, -100);
  EXPECT_EQ(LayOut(config).printed.min_y_mm, 20);
}

TEST(Pattern, TheMarkFillsTheCornerOfTheFirstLinesStartAndTouchesNoLine) {
  PatternConfig config;
  config.frame_margin_mm = config.line_spacing_mm;
  const PatternLayout plain = LayOut(config);
  config.corner_mark = true;
  ASSERT_TRUE(Validate(config)) << Validate(config).error().message;
  const PatternLayout marked = LayOut(config);
  EXPECT_EQ(marked.printed.min_x_mm, plain.printed.min_x_mm);
  EXPECT_EQ(marked.printed.max_y_mm, plain.printed.max_y_mm);
  const PointMm start = marked.lines.front().start;
  int beads = 0;
  for (const Move& move : marked.moves) {
    const bool of_mark = move.kind == MoveKind::kFrame && move.from.x_mm < move.to.x_mm &&
                         move.to.x_mm < start.x_mm + config.line_length_mm / 2;
    if (!of_mark) continue;
    ++beads;
    EXPECT_GT(move.to.x_mm - move.from.x_mm, 0.1 * config.line_length_mm);
    EXPECT_LT(move.from.y_mm, start.y_mm - 2 * config.line_width_mm);
    EXPECT_GT(move.from.y_mm, marked.printed.min_y_mm + config.line_width_mm);
    EXPECT_EQ(move.pressure_advance_s, config.frame_pressure_advance_s);
  }
  EXPECT_GE(beads, 3);
}

TEST(Pattern, AComparisonHasHalfOfItsLinesWithoutPressureAdvance) {
  PatternConfig config;
  config.validated_pressure_advance_s = 0.036;
  ASSERT_TRUE(Validate(config));
  const PatternLayout layout = LayOut(config);
  ASSERT_EQ(layout.lines.size(), 10U);
  for (std::size_t i = 0; i < layout.lines.size(); ++i) {
    EXPECT_EQ(layout.lines[i].pressure_advance_s, i < 5 ? 0 : 0.036);
  }
  for (const Move& move : layout.moves) {
    if (move.line >= 0 && move.kind == MoveKind::kLine) {
      EXPECT_EQ(move.pressure_advance_s, move.line < 5 ? 0 : 0.036);
    }
  }
}

TEST(PatternSummary, FlowAndWeightFollowFromTheBead) {
  PatternConfig config;
  EXPECT_FALSE(Summarise(LayOut(config), config).filament_g);  // the material is unknown
  config.material = "abs";
  const PatternSummary summary = Summarise(LayOut(config), config);
  EXPECT_NEAR(summary.peak_flow_mm3_s, 150 * gcode::BeadArea_mm2(0.495, 0.25), 1e-9);
  const double volume_mm3 = summary.filament_mm * std::numbers::pi / 4 * 1.75 * 1.75;
  ASSERT_TRUE(summary.filament_g);
  EXPECT_NEAR(*summary.filament_g, volume_mm3 * 1.04e-3, 1e-9);
}

TEST(PatternPresets, LeaveWhatSomebodySet) {
  PatternConfig pattern;
  settings::ScanSettings scan;
  ApplyPreset(PatternPreset::kQuick, pattern, scan);
  pattern.line_spacing_mm = 5;
  scan.skip_mm = 2;
  ApplyPreset(PatternPreset::kPaper, pattern, scan);
  EXPECT_EQ(pattern.line_spacing_mm, 5);
  EXPECT_EQ(scan.skip_mm, 2);
  EXPECT_EQ(pattern.segments, PatternConfig{}.segments);
  EXPECT_EQ(scan.scan_speed_mm_s, settings::ScanSettings{}.scan_speed_mm_s);
  EXPECT_EQ(pattern.frame_margin_mm, std::nullopt);
}

// Nothing that the hot end or the motion has to give is more than with the paper's pattern.
TEST(PatternPresets, QuickAsksNoMoreFlowAccelerationOrSpeedThanThePaper) {
  PatternConfig quick;
  ApplyPreset(PatternPreset::kQuick, quick);
  const PatternConfig paper;
  const auto flow = [](const PatternConfig& pattern) {
    return Summarise(LayOut(pattern), pattern).peak_flow_mm3_s;
  };
  EXPECT_LE(flow(quick), flow(paper));
  EXPECT_LE(quick.acceleration_mm_s2, paper.acceleration_mm_s2);
  double fastest_mm_s = 0;
  for (const Move& move : LayOut(paper).moves) {
    fastest_mm_s = std::max(fastest_mm_s, move.speed_mm_s);
  }
  for (const Move& move : LayOut(quick).moves) EXPECT_LE(move.speed_mm_s, fastest_mm_s);
}

TEST(PatternPresets, QuickCrossesNoBeadWithoutLifting) {
  PatternConfig quick;
  ApplyPreset(PatternPreset::kQuick, quick);
  const PatternLayout layout = LayOut(quick);
  const double z_mm = quick.layer_height_mm + quick.z_offset_mm;
  int low = 0;
  for (const Move& move : layout.moves) {
    if (move.kind != MoveKind::kTravel || move.from.z_mm > z_mm) continue;
    ++low;
    EXPECT_EQ(move.from.x_mm, move.to.x_mm) << "beside the lines' ends";
    EXPECT_NEAR(std::abs(move.to.y_mm - move.from.y_mm), quick.line_spacing_mm, 1e-9);
  }
  EXPECT_EQ(low, 9) << "to each line but the first";
  quick.alternate_directions = false;
  const auto problem = FindProblem(quick);
  ASSERT_TRUE(problem);
  EXPECT_EQ(problem->key, "lift_between_lines");
}

}  // namespace
}  // namespace trammel::pressure_advance
