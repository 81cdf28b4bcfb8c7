#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "tool_offset/sheet/sheet_comments.h"
#include "tool_offset/sheet/sheet_gcode.h"
#include "tool_offset/sheet/sheet_layout.h"
#include "tool_offset/sheet/sheet_plan.h"

namespace trammel::tool_offset {
namespace {

constexpr double kRounding_mm = 0.0011;  // places are rounded to a micron

SheetSettings ForPhoto(int tools) {
  SheetSettings settings;
  settings.filament.material = "pla";
  settings.for_photo = true;
  settings.tools.clear();
  for (int tool = 0; tool < tools; ++tool) settings.tools.push_back(tool);
  return settings;
}

TEST(PhotoLayout, BothStructuresOfAToolAndAxisLieOppositeOnePoint) {
  for (int tools = 2; tools <= 8; ++tools) {
    const SheetPlan plan = PlanSheet(ForPhoto(tools));
    std::vector<SheetPoint> middles;
    for (const Structure& a : plan.structures) {
      for (const Structure& b : plan.structures) {
        if (a.purpose != Purpose::kTool || &a == &b || a.axis != b.axis) continue;
        if (a.name.substr(0, 4) != b.name.substr(0, 4)) continue;  // "T1 X"
        middles.push_back(
            {(a.middle.u_mm + b.middle.u_mm) / 2, (a.middle.v_mm + b.middle.v_mm) / 2});
      }
    }
    ASSERT_EQ(middles.size(), static_cast<std::size_t>(4 * (tools - 1)));
    for (const SheetPoint& middle : middles) {
      EXPECT_NEAR(middle.u_mm, middles[0].u_mm, kRounding_mm) << tools;
      EXPECT_NEAR(middle.v_mm, middles[0].v_mm, kRounding_mm) << tools;
    }
    // About the sheet's own middle, but for the code's row below.
    EXPECT_LT(std::abs(middles[0].u_mm), 1) << tools;
    EXPECT_LT(std::abs(middles[0].v_mm), 6) << tools;
  }
}

TEST(PhotoLayout, NothingTouchesAnythingElse) {
  for (int tools = 2; tools <= 8; ++tools) {
    SheetSettings settings = ForPhoto(tools);
    settings.pick_ups = tools % 2;  // structures without a partner
    const SheetPlan plan = PlanSheet(settings);
    const double gap_mm = settings.structure_gap_mm - kRounding_mm;
    const double length_mm = StructureLength_mm(plan.settings);
    const double thickness_mm = StructureThickness_mm(plan.settings);
    const auto size = [&](const Structure& s) {
      return s.axis == Axis::kX ? SheetPoint{length_mm, thickness_mm}
                                : SheetPoint{thickness_mm, length_mm};
    };
    for (const Structure& a : plan.structures) {
      EXPECT_LE(std::abs(a.middle.u_mm) + size(a).u_mm / 2, plan.width_mm / 2) << a.name;
      EXPECT_LE(std::abs(a.middle.v_mm) + size(a).v_mm / 2, plan.height_mm / 2) << a.name;
      for (const CodeCell& cell : plan.code) {
        EXPECT_GE(a.middle.v_mm - size(a).v_mm / 2, cell.middle.v_mm + kCodeLeg_mm / 2) << a.name;
      }
      for (const Structure& b : plan.structures) {
        if (&a == &b) continue;
        const double aside_mm =
            std::abs(a.middle.u_mm - b.middle.u_mm) - (size(a).u_mm + size(b).u_mm) / 2;
        const double above_mm =
            std::abs(a.middle.v_mm - b.middle.v_mm) - (size(a).v_mm + size(b).v_mm) / 2;
        EXPECT_GE(std::max(aside_mm, above_mm), gap_mm) << tools << a.name << b.name;
      }
    }
  }
}

TEST(PhotoLayout, AFileSaysItAndOthersDoNot) {
  const SheetPlan plan = PlanSheet(ForPhoto(3));
  const std::string gcode = WriteSheetGcode(plan).text;
  const auto read = ReadSheetFile(gcode);
  ASSERT_TRUE(read) << read.error().message;
  EXPECT_TRUE(read->for_photo);
  EXPECT_EQ(PlanSheet(*read).sheet_id, plan.sheet_id);
  SheetSettings settings = ForPhoto(3);
  settings.for_photo = false;
  EXPECT_EQ(WriteSheetGcode(PlanSheet(settings)).text.find("for_photo"), std::string::npos);
  EXPECT_NE(PlanSheet(settings).sheet_id, plan.sheet_id);
}

}  // namespace
}  // namespace trammel::tool_offset
