#include "pressure_advance/pattern/pattern_presets.h"

#include <gtest/gtest.h>

#include "pressure_advance/pattern/pattern.h"

namespace trammel::pressure_advance {
namespace {

TEST(PatternPresets, CanBePrintedAndAreCalledAsTheyAreSpelt) {
  for (const PatternPreset preset : {PatternPreset::kQuick, PatternPreset::kPaper}) {
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
