#include "tool_offset/offset/analyse.h"

#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <numbers>

#include "base/statistics.h"
#include "support/matchers.h"
#include "tool_offset/reading/sheet_scene_test_support.h"

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

SheetPlan DefaultPlan(int tools) {
  SheetSettings settings;
  settings.tools.clear();
  for (int tool = 0; tool < tools; ++tool) settings.tools.push_back(tool);
  settings.printer.bed_size_x_mm = settings.printer.bed_size_y_mm = 300;
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

SheetScene QuickScene() {
  SheetScene scene;
  scene.paper.dpi_x = scene.paper.dpi_y = 300;
  scene.paper.blur_px = 0.6;
  scene.angle_rad = 3 * kDegree;
  return scene;
}

SheetResult Read(const SheetPlan& plan, const SheetScene& scene) {
  Random random(7);
  const ScannedScene scan = Scan(plan, scene, random);
  auto result = AnalyseSheet(scan.view(), plan);
  if (!result) {
    ADD_FAILURE() << result.error().message;
    return {};
  }
  return std::move(*result);
}

void ExpectOffset(const ToolReading& tool, double dx_mm, double dy_mm, double tolerance_mm) {
  ASSERT_TRUE(tool.dx_mm.good()) << tool.dx_mm.reason();
  EXPECT_NEAR(tool.dx_mm.quantity().value, dx_mm, tolerance_mm) << "T" << tool.tool;
  EXPECT_NEAR(tool.dy_mm.quantity().value, dy_mm, tolerance_mm) << "T" << tool.tool;
}

/// Error at 300 dpi if teeth are near each other, or colours and levels are uneven.
constexpr double kQuick_mm = 0.002;

TEST(AnalyseSheet, ReadsToolsOfEveryColourEachInItsBestChannel) {
  const SheetPlan plan = SmallPlan({0, 1, 2, 3});
  SheetScene scene = QuickScene();
  scene.paper.channels = 3;
  scene.tool_ink[1] = {60, 220, 230};   // yellow: blue only
  scene.tool_ink[2] = {215, 190, 40};   // cyan: red only
  scene.tool_ink[3] = {231, 231, 231};  // nearly white
  scene.offset_mm[1] = {0.3, 0.2};
  scene.offset_mm[2] = {-0.25, 0.1};
  const SheetResult result = Read(plan, scene);
  ASSERT_EQ(result.tools.size(), 3U);
  ExpectOffset(result.tools[0], 0.3, 0.2, kQuick_mm);
  ExpectOffset(result.tools[1], -0.25, 0.1, kQuick_mm);
  EXPECT_THAT(result.tools[2].dx_mm, Answers(Verdict::kRefused, "T3", "faint"));
  for (const StructureReading& structure : result.structures) {
    if (structure.name == "T1 X+") {
      EXPECT_EQ(structure.channel[0], "blue");
    } else if (structure.name == "T2 X+") {
      EXPECT_EQ(structure.channel[0], "red");
    }
  }
}

TEST(AnalyseSheet, ReadsOffsetsUpToThreeMillimetresFromTheMarkAndAdvisesToPrintAgain) {
  constexpr double kCoarse_mm = 0.02;
  const SheetPlan plan = SmallPlan({0, 1, 2});
  SheetScene scene = QuickScene();
  scene.offset_mm[1] = {2.9, -2.8};
  scene.offset_mm[2] = {0.4, 0.3};
  scene.backlash_x_mm = 0.1;
  scene.backlash_y_mm = 0.08;
  const SheetResult result = Read(plan, scene);
  ASSERT_EQ(result.tools.size(), 2U);
  EXPECT_TRUE(result.tools[0].coarse);
  EXPECT_THAT(result.tools[0].notice, HasSubstr("print and scan the sheet again"));
  ExpectOffset(result.tools[0], 2.9, -2.8, kCoarse_mm);
  EXPECT_LT(std::abs(result.tools[0].dx_mm.quantity().value - 2.9),
            2 * result.tools[0].dx_mm.quantity().standard_uncertainty);
  EXPECT_FALSE(result.tools[1].coarse);
  ExpectOffset(result.tools[1], 0.4, 0.3, kQuick_mm);
}

TEST(AnalyseSheet, ReadsNoCoarseOffsetWhereThePaperHasMovedTheFingersUnevenly) {
  const SheetPlan plan = DefaultPlan(2);
  SheetScene scene = QuickScene();
  scene.offset_mm[1] = {1.5, -1.2};
  scene.wrinkle_mm = 0.18;
  const SheetResult result = Read(plan, scene);
  ASSERT_EQ(result.tools.size(), 1U);
  EXPECT_THAT(result.tools[0].dx_mm.reason(), HasSubstr("unevenly"));
  scene.wrinkle_mm = 0.02;
  const SheetResult flat = Read(plan, scene);
  ASSERT_EQ(flat.tools.size(), 1U);
  ExpectOffset(flat.tools[0], 1.5, -1.2, 0.1);
}

TEST(AnalyseSheet, LeavesOutTornAndBlottedTeethWithTheirReasons) {
  const SheetPlan plan = SmallPlan();
  SheetScene scene = QuickScene();
  scene.offset_mm[1] = {0.1, -0.05};
  const Structure& structure = plan.structures[0];
  for (const int finger : {2, 6}) {
    const Leg leg = FingerLegs(plan, structure, 0, finger)[0];
    const auto a = OnPaper_mm(plan, scene, leg.start);
    const auto b = OnPaper_mm(plan, scene, leg.end);
    support::PaperStroke stroke{a[0], a[1], b[0], b[1], finger == 2 ? 0.5 : 1.0};
    if (finger == 2) stroke.ink = scene.paper.paper;  // torn off; the other is a blot
    scene.more.push_back(stroke);
  }
  const SheetResult result = Read(plan, scene);
  ASSERT_FALSE(result.structures.empty());
  EXPECT_EQ(result.structures[0].teeth_used[0], 7);
  EXPECT_FALSE(result.structures[0].fingers[2].left_out.empty());
  EXPECT_FALSE(result.structures[0].fingers[6].left_out.empty());
  ExpectOffset(result.tools[0], 0.1, -0.05, kQuick_mm);
}

TEST(AnalyseSheet, RecoversProgrammedOffsetsAndPickUps) {
  SheetSettings settings;
  settings.tools = {0};
  settings.self_test = true;
  settings.teeth = 9;
  SheetScene scene = QuickScene();
  scene.paper.dpi_x = scene.paper.dpi_y = 600;
  const SheetResult result = Read(PlanSheet(settings), scene);
  EXPECT_GE(result.self_tests.size(), 8U);
  for (const SelfTestReading& test : result.self_tests) {
    ASSERT_TRUE(test.recovered_mm.good()) << test.name << test.recovered_mm.reason();
    EXPECT_NEAR(test.recovered_mm.quantity().value, test.programmed_mm, 2 * kExact_mm) << test.name;
  }
  settings.tools = {0, 1};
  settings.self_test = false;
  settings.pick_ups = 1;
  scene.offset_mm[1] = {-0.3, 0.25};
  const SheetResult picked = Read(PlanSheet(settings), scene);
  EXPECT_EQ(picked.pick_ups.size(), 2U);
  for (const PickUpReading& reading : picked.pick_ups) {
    ASSERT_TRUE(reading.dx_mm.good()) << reading.dx_mm.reason();
    EXPECT_NEAR(reading.dx_mm.quantity().value, 0, kQuick_mm);
    EXPECT_NEAR(reading.dy_mm.quantity().value, 0, kQuick_mm);
  }
}

TEST(AnalyseSheet, SaysThatAToolsLinesHaveRunTogetherAndNotThatItsInkIsFaint) {
  const SheetPlan plan = SmallPlan();
  SheetScene scene = QuickScene();
  for (const Leg& leg : LegsOfTool(plan, 1)) {
    const auto a = OnPaper_mm(plan, scene, leg.start);
    const auto b = OnPaper_mm(plan, scene, leg.end);
    scene.more.push_back({a[0], a[1], b[0], b[1], 1.0});
  }
  const SheetResult result = Read(plan, scene);
  ASSERT_EQ(result.tools.size(), 1U);
  ASSERT_FALSE(result.tools[0].dx_mm.good());
  EXPECT_THAT(result.tools[0].dx_mm.reason(), Containing("T1", "run together"));
}

// The box fits as well one line further in, where half of the sheet's lines are not in their
// places, or does so along a part of the side.
TEST(AnalyseSheet, SaysThatASideOfTheBoxHasLostALineUnlessItIsReadAllTheSame) {
  const SheetPlan plan = SmallPlan();
  for (const Side side : {kLeft, kRight, kBottom, kTop}) {
    for (const double inset_mm : plan.box_insets_mm) {
      SCOPED_TRACE(fmt::format("side {}, {} mm inside", static_cast<int>(side), inset_mm));
      SheetScene scene = QuickScene();
      scene.offset_mm[1] = {0.2, 0.1};
      scene.more.push_back(PaperOverBoxLine(plan, scene, side, inset_mm));
      Random random(8);
      const ScannedScene scan = Scan(plan, scene, random);
      const auto result = AnalyseSheet(scan.view(), plan);
      if (!result) {
        EXPECT_THAT(result.error().message, HasSubstr("lost one of its 3 lines"));
        continue;
      }
      ASSERT_EQ(result->tools.size(), 1U);
      ExpectOffset(result->tools[0], 0.2, 0.1, kQuick_mm);
    }
  }
}

TEST(AnalyseSheet, SaysThatTheStatedResolutionIsWrongAndUsesTheBox) {
  Random random(8);
  const SheetPlan plan = SmallPlan();
  SheetScene scene = QuickScene();
  scene.offset_mm[1] = {0.2, 0.1};
  const ScannedScene scan = Scan(plan, scene, random);
  const auto result = AnalyseSheet(scan.view(), plan, {75.0, 75.0});
  ASSERT_TRUE(result.has_value()) << result.error().message;
  EXPECT_THAT(result->notices, testing::Contains(HasSubstr("75 x 75 dpi")));
  ExpectOffset(result->tools[0], 0.2, 0.1, kQuick_mm);
}

TEST(AnalyseSheet, RefusesAScanOfTooFewDotsWhateverTheFileStates) {
  Random random(8);
  const SheetPlan plan = SmallPlan();
  SheetScene scene = QuickScene();
  scene.paper.dpi_x = scene.paper.dpi_y = 120;
  const ScannedScene scan = Scan(plan, scene, random);
  const auto result = AnalyseSheet(scan.view(), plan, {600.0, 600.0});
  ASSERT_FALSE(result.has_value());
  EXPECT_EQ(result.error().kind, ErrorKind::kMeasurement);
  EXPECT_THAT(result.error().message, HasSubstr("120 dpi, at least 150"));
}

/// A printer with 5 µm of placement noise, rough edges and wrinkled paper.
SheetScene NoisyScene(Random& random) {
  SheetScene scene;
  scene.paper.dpi_x = 402;
  scene.paper.dpi_y = 400;
  scene.paper.blur_px = 0.6;
  scene.paper.rough_mm = 0.02;
  scene.paper.noise = 3;
  scene.paper.gradient = random.Uniform(-0.1, 0.1);
  scene.angle_rad = random.Uniform(0, 2 * std::numbers::pi);
  scene.placement_mm = 0.005;
  scene.wrinkle_mm = 0.02;
  scene.wrinkle_length_mm = random.Uniform(40, 70);
  scene.backlash_x_mm = random.Uniform(0, 0.08);
  scene.backlash_y_mm = random.Uniform(0, 0.08);
  for (const int tool : {1, 2, 3, 4}) {
    scene.offset_mm[tool] = {random.Uniform(-0.4, 0.4), random.Uniform(-0.4, 0.4)};
  }
  return scene;
}

TEST(AnalyseSheet, IntervalsOfNoisySheetsCoverTheTruthNineteenTimesInTwenty) {
  constexpr int kSheets = 10;
  SheetSettings settings;
  settings.tools = {0, 1, 2, 3, 4};
  settings.teeth = 9;
  const SheetPlan plan = PlanSheet(settings);
  std::vector<double> scaled;  // errors over their standard uncertainty
  int covered = 0;
  for (std::uint64_t seed = 100; seed < 100 + kSheets; ++seed) {
    SCOPED_TRACE(seed);
    Random random(seed);
    const SheetScene scene = NoisyScene(random);
    const ScannedScene scan = Scan(plan, scene, random);
    const auto result = AnalyseSheet(scan.view(), plan);
    ASSERT_TRUE(result) << result.error().message;
    for (const ToolReading& tool : result->tools) {
      const SheetPoint truth = scene.offset_mm.at(tool.tool);
      for (const auto& [value, truth_mm] :
           {std::pair{tool.dx_mm, truth.u_mm}, {tool.dy_mm, truth.v_mm}}) {
        ASSERT_TRUE(value.good()) << value.reason();
        const Quantity& quantity = value.quantity();
        scaled.push_back((quantity.value - truth_mm) / quantity.standard_uncertainty);
        covered += quantity.interval95.lo <= truth_mm && truth_mm <= quantity.interval95.hi;
      }
    }
    EXPECT_NEAR(result->backlash_mm.x.quantity().value, scene.backlash_x_mm, 0.005);
    EXPECT_NEAR(result->backlash_mm.y.quantity().value, scene.backlash_y_mm, 0.005);
  }
  // 80 values: four standard deviations of a coverage of 0.95 are 0.097, of a ratio 0.32. (Scatter
  // from 25 degrees of freedom makes the ratio 1.04.)
  EXPECT_GT(covered, (0.95 - 0.097) * static_cast<double>(scaled.size()));
  EXPECT_NEAR(StandardDeviation(scaled), 1.04, 0.32);
}

/// Along the sheet's own axes.
SheetPoint OffsetAlongSheet(const SheetPlan& plan, SheetPoint shift) {
  const double tilt_rad = plan.settings.tilt_deg * kDegree;
  return {std::cos(tilt_rad) * shift.u_mm - std::sin(tilt_rad) * shift.v_mm,
          std::sin(tilt_rad) * shift.u_mm + std::cos(tilt_rad) * shift.v_mm};
}

// Two pitches further on, the combs of T2 along v lie on themselves but for two teeth, and those
// along u on the ones of T3, whose offset brings them there; and the other way round.
TEST(AnalyseSheet, TellsToolsApartWhoseCombsCouldStandInForEachOther) {
  SheetSettings settings;
  settings.tools = {0, 1, 2, 3, 4};
  const SheetPlan plan = PlanSheet(settings);
  SheetScene scene = QuickScene();
  scene.offset_mm[2] = OffsetAlongSheet(plan, {0, 0.3});
  scene.offset_mm[3] = OffsetAlongSheet(plan, {0, -0.55});
  const SheetResult result = Read(plan, scene);
  ASSERT_EQ(result.tools.size(), 4U);
  for (const ToolReading& tool : result.tools) {
    ASSERT_TRUE(tool.dx_mm.good()) << tool.dx_mm.reason();
    ASSERT_TRUE(tool.dy_mm.good()) << tool.dy_mm.reason();
    EXPECT_NEAR(tool.dx_mm.quantity().value, scene.offset_mm[tool.tool].u_mm, 1e-3) << tool.tool;
    EXPECT_NEAR(tool.dy_mm.quantity().value, scene.offset_mm[tool.tool].v_mm, 1e-3) << tool.tool;
  }
}

/// Every value within a coarse one's interval, or refused: too far off, or by a reason that names
/// two tools.
void ExpectRightOrCovered(const SheetResult& result, const SheetScene& scene) {
  for (const ToolReading& tool : result.tools) {
    const auto offset = scene.offset_mm.find(tool.tool);
    const SheetPoint truth = offset == scene.offset_mm.end() ? SheetPoint{} : offset->second;
    if (!tool.dx_mm.good() && std::max(std::abs(truth.u_mm), std::abs(truth.v_mm)) > 10) {
      EXPECT_NEAR(tool.coarse_mm.u_mm, truth.u_mm, 0.3) << tool.dx_mm.reason();
      EXPECT_NEAR(tool.coarse_mm.v_mm, truth.v_mm, 0.3) << tool.dx_mm.reason();
    } else if (!tool.dx_mm.good()) {
      EXPECT_THAT(tool.dx_mm.reason(), testing::ContainsRegex("T[0-9].*T[0-9]"));
    }
    if (tool.dx_mm.good())
      ExpectOffset(tool, truth.u_mm, truth.v_mm, tool.coarse ? 0.3 : kQuick_mm);
  }
}

/// Tools whose lines hide each other's.
struct Crowd {
  const char* why;
  int tools;
  std::map<int, SheetPoint> offset_mm;
  std::vector<int> good = {};
  std::vector<int> refused = {};  ///< with a reason that names T6 and T7
};

TEST(AnalyseSheet, TakesNoToolsLinesForAnothersWhereTheyHideEachOther) {
  const std::vector<Crowd> crowds = {
      {"one leg of a finger on the place of the other, most of it hidden",
       8,
       {{1, {-4.72, 2.97}},
        {2, {9.18, 6.3}},
        {3, {1.92, -1.63}},
        {4, {0.52, 0.64}},
        {5, {-3.63, 2.45}},
        {6, {1.96, -1.91}},
        {7, {3.43, -11.4}}}},
      {"the same",
       8,
       {{1, {-9.63, -2.94}},
        {2, {1.06, -1.44}},
        {3, {-0.97, 10.82}},
        {4, {0.64, -2.46}},
        {5, {-11.88, -6.87}},
        {6, {-5.63, -1.43}},
        {7, {1.21, 0.49}}}},
      {"half of T3's combs where T2's and T1's are, its own hidden by T2",
       5,
       {{2, {11.9, -9.6}}, {3, {0.1, 0.2}}},
       {1, 4}},
      {"the same", 5, {{2, {3.72, -0.2}}, {3, {4.96, -8.08}}}, {1, 4}},
      {"the same", 5, {{2, {0.73, -1.91}}, {3, {-8.52, 3.32}}}, {1, 4}},
      {"T6 and T7 a millimetre apart along u: each may have drawn either of two combs",
       8,
       {{6, {-7.7, 7.11}}, {7, {-3.66, -3.99}}},
       {},
       {6, 7}},
  };
  for (std::size_t i = 0; i < crowds.size(); ++i) {
    const Crowd& crowd = crowds[i];
    SCOPED_TRACE(fmt::format("{}: {}", i, crowd.why));
    SheetScene scene = QuickScene();
    scene.offset_mm = crowd.offset_mm;
    const SheetResult result = Read(DefaultPlan(crowd.tools), scene);
    ASSERT_EQ(result.tools.size(), static_cast<std::size_t>(crowd.tools - 1));
    ExpectRightOrCovered(result, scene);
    const auto value_of = [&](int tool) {
      return result.tools[static_cast<std::size_t>(tool - 1)].dx_mm;
    };
    for (const int tool : crowd.good) EXPECT_TRUE(value_of(tool).good()) << "T" << tool;
    for (const int tool : crowd.refused) {
      EXPECT_THAT(value_of(tool).reason(), Containing("T6", "T7"));
    }
  }
}

// T3 and T4 print further off than they are looked for; within, most of T3's legs lie on others'.
TEST(AnalyseSheet, TakesNoOtherToolsLinesForOnesThatLieBeyondTheSearch) {
  const SheetPlan plan = DefaultPlan(8);
  SheetScene scene = QuickScene();
  scene.offset_mm = {{1, {0.14, 0.72}},     {2, {-5.42, -9.12}}, {3, {16.79, 3.81}},
                     {4, {-18.07, -16.79}}, {5, {-11.6, -0.86}}, {6, {-6.12, -4.77}},
                     {7, {-2.66, 0.52}}};
  const SheetResult result = Read(plan, scene);
  ASSERT_EQ(result.tools.size(), 7U);
  EXPECT_FALSE(result.tools[2].dx_mm.good());
  EXPECT_FALSE(result.tools[3].dx_mm.good());
  for (const ToolReading& tool : result.tools) {
    if (!tool.dx_mm.good()) continue;
    const SheetPoint truth = scene.offset_mm[tool.tool];
    ExpectOffset(tool, truth.u_mm, truth.v_mm, 0.3);
  }
}

}  // namespace
}  // namespace trammel::tool_offset
