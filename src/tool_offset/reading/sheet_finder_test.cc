#include "tool_offset/reading/sheet_finder.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <numbers>
#include <string>

#include "tool_offset/reading/sheet_scene_test_support.h"

namespace trammel::tool_offset {
namespace {

using ::testing::HasSubstr;

constexpr double kDegree = std::numbers::pi / 180;
/// The fingers must be found within 0.3 mm; a map from the box of a clean sheet is far better.
constexpr double kMapTolerance_mm = 0.03;

SheetPlan SmallPlan() {
  SheetSettings settings;
  settings.teeth = 7;
  return PlanSheet(settings);
}

/// The largest distance, in mm, between where the map puts places all over the sheet and the truth.
double MapError_mm(const SheetPlan& plan, const SheetScene& scene, const SheetOnPage& sheet) {
  double worst = 0;
  for (double s = -0.45; s <= 0.46; s += 0.3) {
    for (double t = -0.45; t <= 0.46; t += 0.3) {
      const SheetPoint point{s * plan.width_mm, t * plan.height_mm};
      const auto truth = OnPaper_mm(plan, scene, point);
      const PagePoint found = sheet.map.ToPage(point);
      const double dx = (found.x_px + 0.5) * 25.4 / scene.paper.dpi_x - truth[0];
      const double dy = (found.y_px + 0.5) * 25.4 / scene.paper.dpi_y - truth[1];
      worst = std::max(worst, std::hypot(dx, dy));
    }
  }
  return worst;
}

struct Lie {
  double dpi;
  double angle_deg;
};

class SheetFinderAtEveryAngle : public ::testing::TestWithParam<Lie> {};

TEST_P(SheetFinderAtEveryAngle, PutsEveryPlaceOfTheSheetWithinThirtyMicrons) {
  Random random(1);
  const SheetPlan plan = SmallPlan();
  SheetScene scene;
  scene.paper.dpi_x = scene.paper.dpi_y = GetParam().dpi;
  scene.paper.noise = 2;
  scene.angle_rad = GetParam().angle_deg * kDegree;
  const ScannedScene scan = Scan(plan, scene, random);
  const auto sheet = FindSheet(scan.view(), plan);
  ASSERT_TRUE(sheet.has_value()) << sheet.error().message;
  EXPECT_LT(MapError_mm(plan, scene, *sheet), kMapTolerance_mm);
  EXPECT_EQ(sheet->code.sheet_id, plan.sheet_id);
  EXPECT_NEAR(Length(sheet->map.u_px_mm), GetParam().dpi / 25.4, 0.01 * GetParam().dpi / 25.4);
}

INSTANTIATE_TEST_SUITE_P(Angles, SheetFinderAtEveryAngle,
                         ::testing::Values(Lie{300, 0}, Lie{300, 3}, Lie{300, 90}, Lie{300, 182},
                                           Lie{300, -91}, Lie{300, 45}, Lie{600, 15},
                                           Lie{1200, 1}));

TEST(SheetFinder, FollowsAPageOfAnotherScaleInEachDirection) {
  Random random(2);
  const SheetPlan plan = SmallPlan();
  SheetScene scene;
  scene.paper.dpi_x = 303;
  scene.paper.dpi_y = 297;
  scene.angle_rad = 20 * kDegree;
  const ScannedScene scan = Scan(plan, scene, random);
  const auto sheet = FindSheet(scan.view(), plan);
  ASSERT_TRUE(sheet.has_value()) << sheet.error().message;
  EXPECT_LT(MapError_mm(plan, scene, *sheet), kMapTolerance_mm);
}

TEST(SheetFinder, ReadsWhiteOnBlackAndColouredPaper) {
  Random random(3);
  const SheetPlan plan = SmallPlan();
  SheetScene scene;
  scene.paper.dpi_x = scene.paper.dpi_y = 300;
  scene.paper.paper = {30, 32, 35};
  scene.tool_ink[0] = {225, 225, 225};
  scene.tool_ink[1] = {200, 225, 225};
  const ScannedScene white_on_black = Scan(plan, scene, random);
  const auto white = FindSheet(white_on_black.view(), plan);
  ASSERT_TRUE(white.has_value()) << white.error().message;

  scene.paper.channels = 3;
  scene.paper.paper = {120, 200, 120};  // green paper, magenta ink of the same grey
  scene.tool_ink[0] = {160, 120, 160};
  const ScannedScene coloured = Scan(plan, scene, random);
  const auto found = FindSheet(coloured.view(), plan);
  ASSERT_TRUE(found.has_value()) << found.error().message;
  EXPECT_LT(MapError_mm(plan, scene, *found), kMapTolerance_mm);
}

std::string ErrorOf(const SheetPlan& plan, const ScannedScene& scan) {
  const auto sheet = FindSheet(scan.view(), plan);
  return sheet ? "found" : sheet.error().message;
}

TEST(SheetFinder, RefusesAMirroredScan) {
  Random random(4);
  const SheetPlan plan = SmallPlan();
  SheetScene scene;
  scene.paper.dpi_x = scene.paper.dpi_y = 300;
  scene.mirrored = true;
  for (const double angle_deg : {0.0, 92.0}) {
    scene.angle_rad = angle_deg * kDegree;
    EXPECT_THAT(ErrorOf(plan, Scan(plan, scene, random)), HasSubstr("mirrored"));
  }
}

TEST(SheetFinder, ReadsTheNumberOfASheetOfAnotherSize) {
  Random random(9);
  const SheetPlan plan = SmallPlan();
  SheetSettings settings;
  settings.tools = {0, 1, 2};
  settings.teeth = 8;
  const SheetPlan other = PlanSheet(settings);
  ASSERT_GT(std::abs(other.width_mm / other.height_mm - plan.width_mm / plan.height_mm), 0.1);
  for (const double dpi : {300.0, 600.0}) {
    SheetScene scene;
    scene.paper.dpi_x = scene.paper.dpi_y = dpi;
    scene.paper.blur_px = 0.7;
    scene.angle_rad = 95 * kDegree;
    const std::string error = ErrorOf(plan, Scan(other, scene, random));
    EXPECT_THAT(error, HasSubstr("shows sheet " + std::to_string(other.sheet_id)));
    EXPECT_THAT(error, HasSubstr("describes sheet " + std::to_string(plan.sheet_id)));
  }
}

TEST(SheetFinder, FindsPaperSmallerThanTheGlassAndAHairAcrossTheBox) {
  Random random(10);
  const SheetPlan plan = SmallPlan();
  SheetScene scene;
  scene.paper.dpi_x = scene.paper.dpi_y = 300;
  scene.paper.blur_px = 0.7;
  scene.angle_rad = 4 * kDegree;
  const auto edge = OnPaper_mm(plan, scene, {plan.width_mm / 2, 5});
  scene.more.push_back({edge[0] - 4, edge[1], edge[0] + 6, edge[1] + 3, 0.2});
  const ScannedScene paper = Scan(plan, scene, random);
  support::PaperOptions options;  // the open lid
  options.dpi_x = options.dpi_y = 300;
  options.width_mm = options.height_mm = 200;
  options.paper = {15, 15, 15};
  ScannedScene glass{support::DrawPaper(options, {}, random)};
  for (int y = 0; y < paper.page.height; ++y) {
    std::copy_n(paper.view().row(y), paper.page.width,
                glass.page.pixels.begin() + (y + 300) * glass.page.width + 400);
  }
  const auto sheet = FindSheet(glass.view(), plan);
  ASSERT_TRUE(sheet.has_value()) << sheet.error().message;
  EXPECT_EQ(sheet->code.sheet_id, plan.sheet_id);
}

TEST(SheetFinder, SaysThatAPageIsEmptyOrTooSmall) {
  Random random(6);
  const SheetPlan plan = SmallPlan();
  support::PaperOptions options;
  options.dpi_x = options.dpi_y = 300;
  options.noise = 5;
  const ScannedScene empty{support::DrawPaper(options, {}, random)};
  EXPECT_THAT(ErrorOf(plan, empty), HasSubstr("no printed sheet"));
  PageView view = empty.view();
  view.height = 20;
  const auto small = FindSheet(view, plan);
  ASSERT_FALSE(small.has_value());
  EXPECT_THAT(small.error().message, HasSubstr("too small"));
}

TEST(SheetFinder, SaysThatABoxIsCutOff) {
  Random random(7);
  const SheetPlan plan = SmallPlan();
  SheetScene scene;
  scene.paper.dpi_x = scene.paper.dpi_y = 300;
  const ScannedScene scan = Scan(plan, scene, random);
  PageView half = scan.view();
  half.width = half.width / 2;
  const auto left = FindSheet(half, plan);
  ASSERT_FALSE(left.has_value());
  EXPECT_THAT(left.error().message, HasSubstr("part of a box"));
}

TEST(SheetFinder, CountsTheLinesThatTheCodeHasLost) {
  Random random(11);
  const SheetPlan plan = SmallPlan();
  SheetPlan drawn = plan;
  constexpr int kMissing = 6;  // of 16 or more; up to 4 missing, the others identify a sheet
  int missing = 0;
  for (CodeCell& cell : drawn.code) {
    if (!cell.dark || missing == kMissing) continue;
    cell.dark = false;
    ++missing;
  }
  SheetScene scene;
  scene.paper.dpi_x = scene.paper.dpi_y = 300;
  EXPECT_THAT(ErrorOf(plan, Scan(drawn, scene, random)),
              HasSubstr("6 lines of the sheet's code are missing"));
}

TEST(SheetFinder, SaysThatTheBoxsLinesHaveRunTogetherWhateverTheirWidth) {
  Random random(12);
  const SheetPlan plan = SmallPlan();
  SheetPlan drawn = plan;
  SheetScene scene;
  scene.paper.dpi_x = scene.paper.dpi_y = 300;
  for (const double width_mm : {1.0, 1.1, 1.2, 1.4}) {
    drawn.settings.line_width_mm = width_mm;
    EXPECT_THAT(ErrorOf(plan, Scan(drawn, scene, random)), HasSubstr("run together")) << width_mm;
  }
}

TEST(SheetFinder, CountsTwoSheetsOnOnePage) {
  Random random(8);
  const SheetPlan plan = SmallPlan();
  SheetScene scene;
  scene.paper.dpi_x = scene.paper.dpi_y = 300;
  const ScannedScene one = Scan(plan, scene, random);
  ScannedScene two = one;
  two.page.height *= 2;
  two.page.pixels.insert(two.page.pixels.end(), one.page.pixels.begin(), one.page.pixels.end());
  EXPECT_THAT(ErrorOf(plan, two), HasSubstr("2 sheets"));
}

}  // namespace
}  // namespace trammel::tool_offset
