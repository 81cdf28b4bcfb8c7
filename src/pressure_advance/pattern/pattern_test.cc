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

TEST(Pattern, OfThePaperIsTheDefaultAndCanBePrinted) {
  const PatternConfig config;
  ASSERT_TRUE(Validate(config)) << Validate(config).error().message;
  const PatternLayout layout = LayOut(config);
  ASSERT_EQ(layout.lines.size(), 10u);
  EXPECT_EQ(layout.lines.front().pressure_advance_s, 0.0);
  EXPECT_EQ(layout.lines.back().pressure_advance_s, 0.06);
  for (std::size_t i = 0; i < layout.lines.size(); ++i) {
    const PatternLine& line = layout.lines[i];
    EXPECT_DOUBLE_EQ(line.end.x_mm - line.start.x_mm, 30.0);
    EXPECT_EQ(line.start.z_mm, 0.25);
    if (i > 0) {
      EXPECT_DOUBLE_EQ(line.start.y_mm - layout.lines[i - 1].start.y_mm, 4.0);
    }
  }
}

TEST(Pattern, ExtrudesThePapersFilamentPerMillimetre) {
  // The paper's code drives 0.045899 mm of filament per mm; 0.495 mm is that figure turned into a
  // width and rounded to 1 um: up to 0.0005 mm * 0.25 mm / 2.405 mm^2 = 5.2e-5.
  constexpr double kRounding = 5.2e-5;
  EXPECT_NEAR(FilamentPerMm(PatternConfig{}), 0.045899, kRounding);
}

TEST(Pattern, ABeadAsWideAsHighIsARoundCord) {
  // pi/4 h^2, to rounding in double precision.
  EXPECT_NEAR(gcode::BeadArea_mm2(0.3, 0.3), std::numbers::pi / 4 * 0.09, 1e-15);
}

TEST(Pattern, TwentySevenOfThePaperFitOnItsBedAndNotOnASmallOne) {
  PatternConfig config;
  config.columns = 9;
  config.rows = 3;
  config.bed_size_x_mm = 350;
  config.bed_size_y_mm = 350;
  ASSERT_TRUE(Validate(config)) << Validate(config).error().message;
  const PatternLayout layout = LayOut(config);
  EXPECT_EQ(layout.patterns.size(), 27u);
  EXPECT_EQ(layout.lines.size(), 270u);
  for (std::size_t i = 1; i < layout.patterns.size(); ++i) {
    for (std::size_t j = 0; j < i; ++j) {
      const BoundsMm& a = layout.patterns[i];
      const BoundsMm& b = layout.patterns[j];
      EXPECT_TRUE(a.min_x_mm > b.max_x_mm || b.min_x_mm > a.max_x_mm || a.min_y_mm > b.max_y_mm ||
                  b.min_y_mm > a.max_y_mm)
          << i << " overlaps " << j;
    }
  }
  config.bed_size_x_mm = 250;
  const auto refused = FindProblem(config);
  ASSERT_TRUE(refused);
  EXPECT_EQ(refused->key, "columns");
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

TEST(Pattern, AlternatingLinesStartWhereTheLastOneEnded) {
  PatternConfig config;
  config.alternate_directions = true;
  const PatternLayout layout = LayOut(config);
  for (std::size_t i = 1; i < layout.lines.size(); ++i) {
    EXPECT_EQ(layout.lines[i].start.x_mm, layout.lines[i - 1].end.x_mm);
  }
  EXPECT_LT(Summarise(layout, config).time_s,
            Summarise(LayOut(PatternConfig{}), PatternConfig{}).time_s);
}

TEST(Pattern, LinesRunIntoTheFrameByTheOverlap) {
  PatternConfig config;
  config.frame_overlap_mm = 0.2;
  const PatternLayout layout = LayOut(config);
  double inner_left_mm = -1e9;
  for (const Move& move : layout.moves) {
    const bool left_side = move.kind == MoveKind::kFrame && move.from.x_mm == move.to.x_mm &&
                           move.from.x_mm < layout.lines[0].start.x_mm;
    if (left_side) inner_left_mm = std::max(inner_left_mm, move.from.x_mm);
  }
  // The line's round end reaches half a bead beyond its start, the loop half a bead inwards.
  const double reach_mm = layout.lines[0].start.x_mm - config.line_width_mm / 2;
  const double loop_edge_mm = inner_left_mm + config.line_width_mm / 2;
  constexpr double kRounding_mm = 1e-9;
  EXPECT_NEAR(loop_edge_mm - reach_mm, 0.2, kRounding_mm);
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

TEST(PatternSummary, TimeOfOneLineFollowsFromItsTrapezoids) {
  // Two configurations that differ by one line of the pattern and what leads to it.
  PatternConfig config;
  config.line_count = 9;
  config.pressure_advance_end_s = 0.048;
  config.position_x_mm = 100;
  config.position_y_mm = 100;
  config.frame_loops = 0;
  config.park_x_mm = 100.2475;  // above the lines' start: the way there has no part in x
  config.park_y_mm = 0;
  const double nine_s = Summarise(LayOut(config), config).time_s;
  config.line_count = 10;
  const double ten_s = Summarise(LayOut(config), config).time_s;
  // By hand, a = 3000. Slow: 5 mm/s over 7.5 mm from or to rest, one ramp of 5/3000 s costing half
  // of itself. Fast: two ramps of 145/3000 s, the rest of 15 mm at 150 mm/s.
  const double slow_s = 7.5 / 5 + 0.5 * 5 / 3000;
  const double ramp_mm = (150.0 * 150 - 5 * 5) / (2 * 3000);
  const double fast_s = 2 * 145.0 / 3000 + (15 - 2 * ramp_mm) / 150;
  const double line_s = 2 * slow_s + fast_s;
  const double travel_mm = std::hypot(30, 4);
  const double travel_s = travel_mm / 150 + 150.0 / 3000;
  const double hop_s = 2 * (0.75 / 5 + 5.0 / 3000) + 2 * (0.5 / 30 + 30.0 / 3000);
  // The nozzle parks 4 mm farther away; that travel is long enough to cruise, at 150 mm/s, and its
  // length changes by less than 4 mm.
  const double most_park_s = 4.0 / 150;
  EXPECT_GE(ten_s - nine_s, line_s + travel_s + hop_s);
  EXPECT_LE(ten_s - nine_s, line_s + travel_s + hop_s + most_park_s);
}

TEST(PatternSummary, FlowAndWeightFollowFromTheBead) {
  PatternConfig config;
  EXPECT_FALSE(Summarise(LayOut(config), config).filament_g);  // of nobody knows what
  config.material = "abs";
  const PatternSummary summary = Summarise(LayOut(config), config);
  EXPECT_NEAR(summary.peak_flow_mm3_s, 150 * gcode::BeadArea_mm2(0.495, 0.25), 1e-9);
  const double volume_mm3 = summary.filament_mm * std::numbers::pi / 4 * 1.75 * 1.75;
  ASSERT_TRUE(summary.filament_g);
  EXPECT_NEAR(*summary.filament_g, volume_mm3 * 1.04e-3, 1e-9);
}

TEST(PatternPlan, SaysWhereTheLinesOfTheLayoutAre) {
  const PatternConfig config;
  const PatternLayout layout = LayOut(config);
  const PatternPlan plan = MakePlan(layout, config, "a.gcode");
  ASSERT_EQ(plan.lines.size(), layout.lines.size());
  EXPECT_EQ(plan.lines[3].pressure_advance_s, layout.lines[3].pressure_advance_s);
  EXPECT_EQ(plan.lines[3].start_y_mm, layout.lines[3].start.y_mm);
  EXPECT_EQ(plan.gcode, "a.gcode");
}

TEST(PatternPresets, CanBePrintedAndAreCalledAsTheyAreSpelt) {
  for (const PatternPreset preset :
       {PatternPreset::kQuick, PatternPreset::kPaper, PatternPreset::kPhoto}) {
    PatternConfig pattern;
    settings::ScanSettings scan;
    ApplyPreset(preset, pattern, scan);
    EXPECT_EQ(FindProblem(pattern), std::nullopt);
    EXPECT_EQ(ParsePatternPreset(pattern.preset), preset);
  }
  EXPECT_EQ(ParsePatternPreset("Quick"), std::nullopt);
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

TEST(PatternTime, HasPartsThatAddUpToTheWhole) {
  const PatternConfig paper;
  const PatternSummary summary = Summarise(LayOut(paper), paper);
  EXPECT_DOUBLE_EQ(summary.time.total_s(), summary.time_s);
  EXPECT_NEAR(summary.time.lines_s, 10 * (15 / 5.0 + 15 / 150.0 + 0.048), 0.1);
  EXPECT_GT(summary.time.to_and_fro_s, 2 * paper.park_lift_mm / paper.z_speed_mm_s);
  EXPECT_GT(summary.time.frame_s, 0);
  EXPECT_GT(summary.time.between_s, 9 * 2 * paper.z_hop_mm / paper.z_speed_mm_s);
}

}  // namespace
}  // namespace trammel::pressure_advance
