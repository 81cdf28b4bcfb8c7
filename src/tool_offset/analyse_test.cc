#include "tool_offset/analyse.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <numbers>

#include "tool_offset/sheet_scene_test_support.h"

namespace trammel::tool_offset {
namespace {

using ::testing::HasSubstr;

constexpr double kDegree = std::numbers::pi / 180;
/// A drawn page has 8 bits: with 200 levels of contrast an edge is right to 0.25 % of a pixel, 0.2
/// µm at 300 dpi, and an offset is the mean of some hundred edges.
constexpr double kExact_mm = 0.1e-3;

SheetPlan SmallPlan(std::vector<int> tools = {0, 1}) {
  SheetSettings settings;
  settings.tools = std::move(tools);
  settings.teeth = 9;
  return PlanSheet(settings);
}

struct Lie {
  double dpi;
  double angle_deg;
};

class AnalyseCleanSheet : public ::testing::TestWithParam<Lie> {};

TEST_P(AnalyseCleanSheet, FindsOffsetsAndPlayToATenthOfAMicron) {
  Random random(1);
  const SheetPlan plan = SmallPlan();
  SheetScene scene;
  scene.paper.dpi_x = scene.paper.dpi_y = GetParam().dpi;
  scene.angle_rad = GetParam().angle_deg * kDegree;
  scene.offset_mm[1] = {0.213, -0.127};
  scene.backlash_x_mm = 0.06;
  scene.backlash_y_mm = 0.04;
  const ScannedScene scan = Scan(plan, scene, random);
  const auto result = AnalyseSheet(scan.view(), plan);
  ASSERT_TRUE(result.has_value()) << result.error().message;
  ASSERT_EQ(result->tools.size(), 1U);
  const ToolReading& tool = result->tools[0];
  ASSERT_TRUE(tool.dx_mm.good()) << tool.dx_mm.reason();
  EXPECT_NEAR(tool.dx_mm.quantity().value, 0.213, kExact_mm);
  EXPECT_NEAR(tool.dy_mm.quantity().value, -0.127, kExact_mm);
  ASSERT_TRUE(result->backlash_mm.x.good());
  EXPECT_NEAR(result->backlash_mm.x.quantity().value, 0.06, 2 * kExact_mm);
  EXPECT_NEAR(result->backlash_mm.y.quantity().value, 0.04, 2 * kExact_mm);
  EXPECT_NEAR(result->control_bias_mm.x.quantity().value, 0, kExact_mm);
  EXPECT_NEAR(result->control_bias_mm.y.quantity().value, 0, kExact_mm);
  EXPECT_NEAR(result->px_per_mm.x.quantity().value, GetParam().dpi / 25.4, 1e-4 * GetParam().dpi);
  for (const StructureReading& structure : result->structures) {
    EXPECT_EQ(structure.teeth_used[0], 9) << structure.name;
    EXPECT_EQ(structure.teeth_used[1], 9) << structure.name;
  }
}

INSTANTIATE_TEST_SUITE_P(Lies, AnalyseCleanSheet,
                         ::testing::Values(Lie{300, 0}, Lie{300, 2}, Lie{600, 91}, Lie{600, 195},
                                           Lie{600, 40}, Lie{1200, -1}));

}  // namespace
}  // namespace trammel::tool_offset
