#include "tool_offset/report/sheet_preview.h"

#include <gtest/gtest.h>

#include "document/parsers_test_support.h"

namespace trammel::report {
namespace {

TEST(SheetPreview, DrawsEightToolsOnARoundBedAndASelfTest) {
  tool_offset::SheetSettings settings;
  settings.tools = {7, 6, 5, 4, 3, 2, 1, 0};
  settings.tilt_deg = -20;
  settings.pick_ups = 1;
  settings.printer.bed_shape = settings::BedShape::kEllipse;
  settings.printer.bed_size_x_mm = 500;
  settings.printer.bed_size_y_mm = 500;
  EXPECT_EQ(test::XmlProblem(SheetPreview(tool_offset::PlanSheet(settings)).ToSvg()), "");
  settings.tools = {0};
  settings.pick_ups = 0;
  settings.self_test = true;
  EXPECT_EQ(test::XmlProblem(SheetPreview(tool_offset::PlanSheet(settings)).ToSvg()), "");
}

}  // namespace
}  // namespace trammel::report
