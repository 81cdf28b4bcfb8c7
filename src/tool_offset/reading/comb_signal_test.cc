#include "tool_offset/reading/comb_signal.h"

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>

#include "tool_offset/reading/sheet_finder.h"
#include "tool_offset/reading/sheet_scene_test_support.h"

namespace trammel::tool_offset {
namespace {

/// Against the truth of a clean page; the fingers are read ten times as well.
constexpr double kPhase_mm = 0.002;

TEST(CombSignal, EveryHarmonicShowsTheOffsetOfACleanSheet) {
  Random random(1);
  SheetSettings settings;
  settings.teeth = 9;
  settings.tilt_deg = 5;
  const SheetPlan plan = PlanSheet(settings);
  SheetScene scene;
  scene.paper.dpi_x = scene.paper.dpi_y = 600;
  scene.angle_rad = 0.03;
  scene.offset_mm[1] = {0.2, 0.1};
  const ScannedScene scan = Scan(plan, scene, random);
  const auto sheet = FindSheet(scan.view(), plan);
  ASSERT_TRUE(sheet.has_value()) << sheet.error().message;
  const double c = std::cos(settings.tilt_deg * std::numbers::pi / 180);
  const double s = std::sin(settings.tilt_deg * std::numbers::pi / 180);
  const SheetPoint shift{0.2 * c + 0.1 * s, -0.2 * s + 0.1 * c};
  int compared = 0;
  for (const Structure& structure : plan.structures) {
    if (structure.purpose != Purpose::kTool) continue;
    const std::array<SheetPoint, 2> shifts{structure.combs[0].tool == 1 ? shift : SheetPoint{},
                                           structure.combs[1].tool == 1 ? shift : SheetPoint{}};
    const auto signal = ReadCombSignal(scan.view(), sheet->map, plan, structure,
                                       {sheet->reference_mix, sheet->reference_mix}, shifts);
    ASSERT_TRUE(signal.has_value());
    const double sign = structure.combs[1].tool == 1 ? 1 : -1;
    const double truth_mm = sign * (structure.axis == Axis::kX ? shift.u_mm : shift.v_mm);
    for (const double offset_mm : signal->offset_mm) {
      EXPECT_NEAR(offset_mm, truth_mm, kPhase_mm) << structure.name;
    }
    EXPECT_NEAR(signal->combined_offset_mm, truth_mm, kPhase_mm) << structure.name;
    EXPECT_EQ(signal->comb[0].local_mm.size(), 9U);
    ++compared;
  }
  EXPECT_EQ(compared, 4);
}

}  // namespace
}  // namespace trammel::tool_offset
