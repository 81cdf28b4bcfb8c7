// Reports on sheets that are drawn and scanned here; no claim about the estimator.
#include "tool_offset/report/offset_report.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <limits>

#include "document/parsers_test_support.h"
#include "support/matchers.h"
#include "tool_offset/offset/analyse.h"
#include "tool_offset/original/original_sheet.h"
#include "tool_offset/reading/sheet_scene_test_support.h"

namespace trammel::report {
namespace {

using ::testing::AllOf;
using ::testing::HasSubstr;
using ::testing::Not;
namespace to = tool_offset;

struct Drawn {
  OffsetAnalysis analysis;
  OffsetReportInput input;
};

// A small sheet of three tools, the last of which printed nothing.
to::SheetSettings Settings() {
  to::SheetSettings settings;
  settings.tools = {0, 1, 2};
  settings.teeth = 7;
  return settings;
}

to::ScannedScene ScanOf(const to::SheetPlan& plan, double angle_rad) {
  to::SheetScene scene;
  scene.angle_rad = angle_rad;
  scene.paper.dpi_x = scene.paper.dpi_y = 300;
  scene.offset_mm[1] = {0.2, -0.1};
  scene.silent_tools = {2};
  scene.placement_mm = 0.003;
  Random random(7);
  return to::Scan(plan, scene, random);
}

// Drawn and read once for all.
const Drawn& Sheet() {
  static const Drawn* drawn = [] {
    auto* made = new Drawn;
    made->analysis.plan = to::PlanSheet(Settings());
    const to::ScannedScene scan = ScanOf(made->analysis.plan, 0.1);
    auto result = to::AnalyseSheet(scan.view(), made->analysis.plan);
    if (!result) ADD_FAILURE() << result.error().message;
    if (result) {
      made->input.pictures.push_back(DrawnPage(scan.view(), made->analysis.plan, *result));
      made->analysis.scans.push_back({"a & b <\xff>.png", 1, 1, std::move(*result)});
      const std::vector<std::vector<to::SheetResult>> sheets = {{made->analysis.scans[0].result}};
      made->analysis.combined = to::Combine(sheets);
    }
    made->input.analysis = &made->analysis;
    made->analysis.refused = {{"c.png", "scan c.png: <no sheet> & nothing"}};
    return made;
  }();
  return *drawn;
}

TEST(OffsetReport, IsAWholePageThatLoadsNothingAndEscapesNames) {
  const std::string page = OffsetReport(Sheet().input);
  EXPECT_EQ(test::XmlProblem(page), "");
  EXPECT_THAT(page,
              Containing("default-src 'none'", "a &amp; b &lt;", "&lt;no sheet&gt; &amp; nothing"));
  EXPECT_THAT(page, AllOf(Not(HasSubstr("http://")), Not(HasSubstr("https://")),
                          Not(HasSubstr("<script"))));
}

TEST(OffsetReport, ShowsAToolThatIsRefusedWithItsReasonAndWithoutANumber) {
  const std::string page = OffsetReport(Sheet().input);
  EXPECT_THAT(page, Containing("class=\"card head refused\"", "colspan=\"4\">T2: at no place",
                               "T2: at no place within", "1 of 2 tools have an offset",
                               ">T1</td><td data-name=\"x\"><span>+0.19", "95 %: +0.19"));
}

TEST(OffsetReport, HasTheLinesToPasteWithTheSignOfTheSheetsFirmware) {
  // T1 lands 0.2 mm to the right and 0.1 mm to the front.
  const std::string page = OffsetReport(Sheet().input);
  EXPECT_THAT(page, Containing("PARAMETER=gcode_x_offset VALUE=-0.199", Not(HasSubstr("T=2"))));
  EXPECT_LT(page.find("SET_TOOL_PARAMETER"), page.find("<svg"));
  OffsetReportInput kept = Sheet().input;
  kept.kept = {{1, {0.5, 0}, {0.301, 0.1}}};
  EXPECT_THAT(OffsetReport(kept), HasSubstr("PARAMETER=gcode_x_offset VALUE=0.301"));
}

TEST(OffsetReport, DrawsAnArrowFromTheReferenceToolToEachThatHasAnOffset) {
  const auto figure = ToolArrowsFigure(Sheet().analysis);
  ASSERT_TRUE(figure);
  EXPECT_THAT(figure->seen, HasSubstr("T1 lands 0.199 mm to the right and 0.100 mm to the front"));
  EXPECT_THAT(figure->canvas.ToSvg(), Containing(">T0</text>",
                                                 ">T1: +0.199, -0.100"
                                                 " mm</text>"));
  OffsetAnalysis none = Sheet().analysis;
  none.combined.tools.clear();
  EXPECT_FALSE(ToolArrowsFigure(none));
}

TEST(OffsetReport, HasAPictureOfThePageForEveryStep) {
  const DrawnFigure& page = Sheet().input.pictures.at(0);
  EXPECT_EQ(page.name, "page");
  EXPECT_EQ(test::XmlProblem(page.svg), "");
  EXPECT_THAT(page.svg, HasSubstr("data:image/jpeg;base64,"));
  EXPECT_THAT(page.html[0], Containing("<figcaption>", "class=\"narrow\""));
  EXPECT_LT(page.html.back().size(), page.html.front().size());
}

TEST(OffsetReport, TakesValuesThatAreNotFiniteAndStructuresWithoutFingers) {
  Drawn sheet;
  sheet.analysis = Sheet().analysis;
  sheet.input.analysis = &sheet.analysis;
  to::SheetResult& result = sheet.analysis.scans[0].result;
  const double nan = std::numeric_limits<double>::quiet_NaN();
  for (to::FingerReading& finger : result.structures[0].fingers) {
    finger.residual_mm = finger.position_mm = finger.place.x_px = nan;
  }
  result.structures[1].fingers.clear();
  result.structures[1].offset_mm = Measured::Refused("gone");
  result.chi_square_per_freedom = nan;
  const to::ScannedScene scan = ScanOf(sheet.analysis.plan, 0.1);
  sheet.input.pictures.push_back(DrawnPage(scan.view(), sheet.analysis.plan, result));
  EXPECT_EQ(test::XmlProblem(OffsetReport(sheet.input)), "");
}

TEST(OffsetReport, ShowsSelfTestsAndPickUpsWhereThereAreAny) {
  OffsetAnalysis analysis = Sheet().analysis;
  Quantity quantity;
  quantity.value = 0.1;
  quantity.interval95 = {0.09, 0.11};
  to::SheetResult& result = analysis.scans[0].result;
  result.self_tests = {{"self-test X 1", 0.1, Measured::Good(quantity)},
                       {"self-test X 2", 0.2, Measured::Refused("torn")}};
  result.pick_ups = {{1, 1, Measured::Good(quantity), Measured::CannotTell("torn")}};
  OffsetReportInput input = Sheet().input;
  input.analysis = &analysis;
  for (const std::string& text : {OffsetReport(input), OffsetText(analysis)}) {
    EXPECT_THAT(text, Containing("self-test X 1, +0.10 mm", "T1 pick-up 1", "torn", "95 %: +0.09"));
  }
}

TEST(OffsetReport, APageOfManyScansStaysSmallEnoughToBeSent) {
  Drawn many;
  many.analysis = Sheet().analysis;
  many.input = Sheet().input;
  many.input.analysis = &many.analysis;
  for (int i = 1; i < 20; ++i) {
    many.analysis.scans.push_back(many.analysis.scans.front());
    many.input.pictures.push_back(many.input.pictures.front());
  }
  const std::string page = OffsetReport(many.input);
  EXPECT_LE(page.size(), kMaxPageBytes);
  EXPECT_EQ(test::XmlProblem(page), "");
  EXPECT_THAT(page, Containing("Scan 20 (sheet 1)", "data:image/jpeg"));
}

}  // namespace
}  // namespace trammel::report
