// Sheets of the original generator: planned, drawn from their plan, read.
#include "tool_offset/original/original_sheet.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <numbers>
#include <set>

#include "support/matchers.h"
#include "tool_offset/offset/analyse.h"
#include "tool_offset/reading/sheet_scene_test_support.h"

namespace trammel::tool_offset {
namespace {

using ::testing::Contains;
using ::testing::HasSubstr;

/// A clean page of 8 bits: what rounding and the box's straight lines leave.
constexpr double kClean_mm = 0.0005;
/// 95 % of 300 dpi pages without noise; a pixel is 0.085 mm.
constexpr double kCoarsePixels_mm = 0.003;

OriginalSheet OfTools(const std::vector<int>& tools) {
  OriginalSheet sheet;
  sheet.tools = tools;
  sheet.moved.assign(tools.size(), {});
  return sheet;
}

TEST(OriginalSheet, KeepsAllOfItsInkInItsBoxAndItsNamesApart) {
  for (const std::vector<int>& tools : {std::vector{2, 2, 1, 1, 2}, {7}, {3, 4, 5, 6}}) {
    const SheetPlan plan = PlanOriginal(OfTools(tools));
    std::set<std::string> names;
    for (const Structure& structure : plan.structures) names.insert(structure.name);
    EXPECT_EQ(names.size(), plan.structures.size());
    EXPECT_EQ(plan.structures.size(), 4 * tools.size());
    for (const int tool : plan.settings.tools) {
      for (const Leg& leg : LegsOfTool(plan, tool)) {
        for (const SheetPoint& point : {leg.start, leg.end}) {
          constexpr double kMargin_mm = 3;
          EXPECT_LT(std::abs(point.u_mm), plan.width_mm / 2 - kMargin_mm);
          EXPECT_LT(std::abs(point.v_mm), plan.height_mm / 2 - kMargin_mm);
        }
      }
    }
  }
}

TEST(OriginalSheet, RefusesWhatCannotBeOne) {
  EXPECT_FALSE(Validate(OfTools({})));
  EXPECT_FALSE(Validate(OfTools({1, 2, 3, 4, 5, 6})));
  EXPECT_FALSE(Validate(OfTools({1, -1})));
  OriginalSheet sheet = OfTools({1, 2});
  sheet.rotation_deg = 45;
  EXPECT_FALSE(Validate(sheet));
  sheet = OfTools({1, 2});
  sheet.moved[0] = {0.6, 0};
  EXPECT_FALSE(Validate(sheet));
  EXPECT_TRUE(Validate(OfTools({1, 2})));
}

SheetScene Scene() {
  SheetScene scene;
  scene.offset_mm = {{1, {0.31, -0.17}}, {3, {-0.42, 0.25}}};
  scene.backlash_x_mm = 0.06;
  scene.backlash_y_mm = 0.04;
  return scene;
}

Result<SheetResult> Read(const SheetPlan& printed, const SheetPlan& read_as,
                         const SheetScene& scene, std::uint64_t seed = 5) {
  Random random(seed);
  const ScannedScene scan = Scan(printed, scene, random);
  return AnalyseSheet(scan.view(), read_as);
}

void ExpectTool(const ToolReading& tool, SheetPoint truth, double within_mm) {
  ASSERT_TRUE(tool.dx_mm.good()) << tool.dx_mm.reason();
  ASSERT_TRUE(tool.dy_mm.good()) << tool.dy_mm.reason();
  EXPECT_NEAR(tool.dx_mm.quantity().value, truth.u_mm, within_mm);
  EXPECT_NEAR(tool.dy_mm.quantity().value, truth.v_mm, within_mm);
}

TEST(OriginalRead, RecoversOffsetsAndPlayOfACleanPage) {
  const SheetPlan plan = PlanOriginal(OfTools({1, 2, 3}));
  const SheetScene scene = Scene();
  const auto result = Read(plan, plan, scene);
  ASSERT_TRUE(result) << result.error().message;
  ASSERT_EQ(result->tools.size(), 2U);
  for (const ToolReading& tool : result->tools) {
    ExpectTool(tool, scene.offset_mm.at(tool.tool), kClean_mm);
  }
  ASSERT_TRUE(result->backlash_mm.x.good() && result->backlash_mm.y.good());
  EXPECT_NEAR(result->backlash_mm.x.quantity().value, scene.backlash_x_mm, kClean_mm);
  EXPECT_NEAR(result->backlash_mm.y.quantity().value, scene.backlash_y_mm, kClean_mm);
  EXPECT_THAT(result->notices, Contains(HasSubstr("identity not checked")));
}

TEST(OriginalRead, HasTheSameSignsWhicheverOfEightWaysThePageLies) {
  const SheetPlan plan = PlanOriginal(OfTools({2, 1}));
  for (int way = 0; way < 8; ++way) {
    SheetScene scene = Scene();
    scene.paper.dpi_x = scene.paper.dpi_y = 300;
    scene.angle_rad = (way % 4) * std::numbers::pi / 2 + 0.04;
    scene.mirrored = way >= 4;
    const auto result = Read(plan, plan, scene);
    ASSERT_TRUE(result) << way << ": " << result.error().message;
    ExpectTool(result->tools[0], scene.offset_mm.at(1), kCoarsePixels_mm);
    EXPECT_EQ(result->sheet.map.mirrored(), scene.mirrored);
    const auto mirrored = Contains(HasSubstr("shows the print mirrored"));
    if (scene.mirrored) {
      EXPECT_THAT(result->notices, mirrored);
    } else {
      EXPECT_THAT(result->notices, ::testing::Not(mirrored));
    }
  }
}

TEST(OriginalRead, RefusesASheetOfAnotherNumberOfTools) {
  SheetScene scene = Scene();
  scene.paper.dpi_x = scene.paper.dpi_y = 300;
  // Those of two and of five have nearly the same shape.
  for (const auto& [printed, read_as] : {std::pair{OfTools({1, 2}), OfTools({1, 2, 3})},
                                         {OfTools({1, 2}), OfTools({1, 2, 3, 4, 5})},
                                         {OfTools({1, 2, 3}), OfTools({1, 2})}}) {
    EXPECT_THAT(Read(PlanOriginal(printed), PlanOriginal(read_as), scene),
                FailsWith(ErrorKind::kMeasurement, " pairs"));
  }
}

TEST(OriginalRead, RefusesAScanOfTooFewDots) {
  const SheetPlan plan = PlanOriginal(OfTools({1, 2}));
  SheetScene scene = Scene();
  scene.paper.dpi_x = scene.paper.dpi_y = 150;
  EXPECT_THAT(Read(plan, plan, scene), FailsWith("150 dpi, at least 200"));
}

TEST(OriginalRead, NoticesOnTheControlThatTheFileIsAnother) {
  OriginalSheet printed = OfTools({1, 2});
  printed.moved[1] = {0.08, 0};
  const SheetPlan plan = PlanOriginal(OfTools({1, 2}));
  EXPECT_THAT(Read(PlanOriginal(printed), plan, Scene()),
              FailsWith("was not printed from this file", "+0.080 mm along u"));
}

TEST(OriginalRead, TakesOffWhatTheFileMovesOnPurposeAndSaysSo) {
  OriginalSheet sheet = OfTools({1, 2, 3});
  sheet.moved[0] = {0.1, -0.1};
  const SheetPlan plan = PlanOriginal(sheet);
  const SheetScene scene = Scene();
  const auto result = Must(Read(plan, plan, scene));
  ExpectTool(result.tools[0], scene.offset_mm.at(1), kClean_mm);
  EXPECT_THAT(result.notices, Contains(HasSubstr("moves combs on purpose")));
}

TEST(OriginalRead, GivesBackProgrammedOffsetsWithoutThePublishedGainError) {
  OriginalSheet sheet = OfTools({2, 2, 2, 2, 2});
  const std::array<double, 5> set_mm{0, -0.05, 0.05, -0.1, 0.1};
  for (std::size_t i = 0; i < 5; ++i) sheet.moved[i] = {set_mm[i], set_mm[i]};
  const SheetPlan plan = PlanOriginal(sheet);
  const auto result = Must(Read(plan, plan, Scene()));
  EXPECT_TRUE(result.tools.empty());
  ASSERT_EQ(result.self_tests.size(), 16U);
  for (const SelfTestReading& test : result.self_tests) {
    ASSERT_TRUE(test.recovered_mm.good()) << test.recovered_mm.reason();
    EXPECT_NEAR(test.recovered_mm.quantity().value, test.programmed_mm, kClean_mm);
    EXPECT_GT(std::abs(test.programmed_mm), 0.04);
  }
}

TEST(OriginalRead, AnswersCoarselyBeyondTheCombsAndRefusesFarOff) {
  const SheetPlan plan = PlanOriginal(OfTools({1, 2, 3}));
  SheetScene scene = Scene();
  scene.offset_mm = {{1, {1.2, -0.9}}, {3, {-2.6, 0.1}}};
  const auto result = Must(Read(plan, plan, scene));
  constexpr double kCoarse_mm = 0.05;
  EXPECT_TRUE(result.tools[0].coarse);
  ExpectTool(result.tools[0], {1.2, -0.9}, kCoarse_mm);
  EXPECT_EQ(result.tools[1].dx_mm.verdict(), Verdict::kRefused);
}

}  // namespace
}  // namespace trammel::tool_offset
