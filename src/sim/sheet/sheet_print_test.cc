#include "sim/sheet/sheet_print.h"

#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <numbers>
#include <string>
#include <vector>

#include "base/statistics.h"

namespace trammel::sim {
namespace {

using ::testing::HasSubstr;

constexpr double kExactMm = 1e-9;
constexpr std::uint64_t kSeed = 11;  // development

PrintedSheet Printed(const std::string& gcode, const SheetMachine& machine,
                     const SheetPaper& paper = {}) {
  const auto program = InterpretSheet(gcode, {});
  EXPECT_TRUE(program) << (program ? "" : program.error().message);
  const auto sheet = PrintSheet(*program, machine, paper, Random(kSeed));
  EXPECT_TRUE(sheet) << (sheet ? "" : sheet.error().message);
  return sheet ? *sheet : PrintedSheet{};
}

// Lines along +y at the given x, each drawn after an approach from `from_x`; 0.4 mm wide.
std::string LinesAlongY(int count, double first_x_mm, double from_x_mm) {
  std::string gcode = "M83\n";
  for (int i = 0; i < count; ++i) {
    const double x_mm = first_x_mm + 4 * i;
    gcode += fmt::format("G0 X{} Y10\nG0 X{}\nG1 Y16 E0.18\n", x_mm + from_x_mm, x_mm);
  }
  return gcode;
}

double MeanX(const InkStroke& stroke) {
  double sum = 0;
  for (const StrokePoint& point : stroke.points) {
    sum += point.centre.x_mm + (point.right_mm - point.left_mm) / 2;
  }
  return sum / static_cast<double>(stroke.points.size());
}

TEST(SheetPrint, AnIdealMachineDrawsWhereItIsSent) {
  const PrintedSheet sheet = Printed(LinesAlongY(3, 10, -2), {});
  ASSERT_EQ(sheet.strokes.size(), 3U);
  for (std::size_t i = 0; i < 3; ++i) {
    EXPECT_NEAR(MeanX(sheet.strokes[i]), 10.0 + 4.0 * static_cast<double>(i), kExactMm);
    EXPECT_NEAR(sheet.strokes[i].points.front().centre.y_mm, 10, kExactMm);
    EXPECT_NEAR(sheet.strokes[i].points.back().centre.y_mm, 16, kExactMm);
  }
}

TEST(SheetPrint, WidthFollowsFromTheFilament) {
  // 0.18 mm of 1.75 mm filament over 6 mm: 0.0722 mm2; (w - 0.2) 0.2 + pi 0.01 = 0.0722.
  constexpr double kWidthMm = 0.4037;
  const PrintedSheet sheet = Printed(LinesAlongY(1, 10, -2), {});
  const StrokePoint& middle = sheet.strokes[0].points[60];
  EXPECT_NEAR(middle.left_mm + middle.right_mm, kWidthMm, 1e-3);
}

TEST(SheetPrint, PlayPutsTheNozzleHalfOfItBehindTheWay) {
  SheetMachine machine;
  machine.backlash_mm = {0.06, 0};
  EXPECT_NEAR(MeanX(Printed(LinesAlongY(1, 10, -2), machine).strokes[0]), 9.97, kExactMm);
  EXPECT_NEAR(MeanX(Printed(LinesAlongY(1, 10, 2), machine).strokes[0]), 10.03, kExactMm);
}

TEST(SheetPrint, PlayIsTakenUpAlongTheWayAndNotAtATurn) {
  SheetMachine machine;
  machine.backlash_mm = {0.06, 0};
  // Out to x = 10 in +, then drawn back in -: the first 0.06 mm do not move the nozzle.
  const PrintedSheet sheet = Printed("M83\nG0 X0\nG0 X10 Y5\nG1 X4 E0.2\n", machine);
  const std::vector<StrokePoint>& points = sheet.strokes[0].points;
  EXPECT_NEAR(points.front().centre.x_mm, 9.97, kExactMm);
  EXPECT_NEAR(points[1].centre.x_mm, 9.97, kExactMm);  // 0.05 mm on its way
  EXPECT_NEAR(points[2].centre.x_mm, 9.93, kExactMm);  // at 9.9 + 0.03
  EXPECT_NEAR(points.back().centre.x_mm, 4.03, kExactMm);
}

TEST(SheetPrint, AHalfTakenUpPlayStaysHalf) {
  SheetMachine machine;
  machine.backlash_mm = {0.06, 0};
  // Beyond by 0.03 mm and back: the nozzle stands in the middle of the play.
  const PrintedSheet sheet = Printed("M83\nG0 X5\nG0 X10.03\nG0 X10 Y10\nG1 Y16 E0.2\n", machine);
  EXPECT_NEAR(MeanX(sheet.strokes[0]), 10, kExactMm);
}

TEST(SheetPrint, ToolOffsetsShiftTheInkAndTheTruthSaysSo) {
  SheetMachine machine;
  machine.tools[1].offset_mm = {0.25, -0.1};
  const PrintedSheet sheet =
      Printed("M83\nG0 X10 Y10\nG1 Y16 E0.2\nT1\nSET_GCODE_OFFSET X=-0.05\nG0 X10 Y10\nG1 Y16 E0.2",
              machine);
  ASSERT_EQ(sheet.strokes.size(), 2U);
  EXPECT_NEAR(MeanX(sheet.strokes[1]), 10.2, kExactMm);
  const auto offset = OffsetOf(sheet, 1, 0);
  ASSERT_TRUE(offset);
  EXPECT_NEAR(offset->x_mm, 0.2, kExactMm);
  EXPECT_NEAR(offset->y_mm, -0.1, kExactMm);
  EXPECT_FALSE(OffsetOf(sheet, 2, 0));
}

TEST(SheetPrint, PlacementWidthAndRoughnessScatterAsStated) {
  SheetMachine machine;
  machine.leg_placement_mm = 0.005;
  machine.edge_roughness_mm = 0.020;
  machine.edge_correlation_mm = 0.2;
  const PrintedSheet sheet = Printed(LinesAlongY(2000, 10, -2), machine);
  std::vector<double> place;
  std::vector<double> edge;
  double lagged = 0;
  for (std::size_t i = 0; i < sheet.strokes.size(); ++i) {
    place.push_back(sheet.strokes[i].points[3].centre.x_mm - 10 - 4 * static_cast<double>(i));
    edge.push_back(sheet.strokes[i].points[60].left_mm);
    lagged += (sheet.strokes[i].points[64].left_mm - 0.20185) * (edge.back() - 0.20185);
  }
  // Standard deviations of 2000 values are known to 1.6 %; four of those.
  EXPECT_NEAR(StandardDeviation(place), 0.005, 0.065 * 0.005) << "seed " << kSeed;
  EXPECT_NEAR(StandardDeviation(edge), 0.020, 0.065 * 0.020) << "seed " << kSeed;
  // 4 steps of 0.05 mm are one correlation length; a correlation of 2000 pairs: 1 / sqrt(2000).
  EXPECT_NEAR(lagged / 2000 / (0.020 * 0.020), std::exp(-1), 4 / std::sqrt(2000.0));
}

TEST(SheetPrint, WrinklesMoveTheInkSmoothly) {
  SheetPaper paper;
  paper.wrinkle = {{{0.02, 0}, 50, 0, std::numbers::pi / 2, 0}};
  const PrintedSheet sheet = Printed(LinesAlongY(3, 0, -2), {}, paper);
  for (std::size_t i = 0; i < 3; ++i) {
    const double x_mm = 4 * static_cast<double>(i);
    EXPECT_NEAR(MeanX(sheet.strokes[i]), x_mm + 0.02 * std::cos(2 * std::numbers::pi * x_mm / 50),
                kExactMm);
  }
}

TEST(SheetPrint, MissingToolsAndBrokenLegsLeaveNoInkThere) {
  SheetMachine machine;
  machine.tools[0].prints = false;
  EXPECT_TRUE(Printed(LinesAlongY(3, 0, -2), machine).strokes.empty());
  machine.tools[0] = {};
  machine.tools[0].broken_share = 1;
  double ink_mm = 0;
  for (const InkStroke& stroke : Printed(LinesAlongY(100, 0, -2), machine).strokes) {
    ink_mm += stroke.points.back().centre.y_mm - stroke.points.front().centre.y_mm;
  }
  // 70 % of the legs keep 60 % of their length on average.
  EXPECT_NEAR(ink_mm / 600, 0.42, 0.12) << "seed " << kSeed;
}

TEST(SheetPrint, RetractedFilamentHasToBePrimedFirst) {
  const PrintedSheet sheet = Printed("M83\nG1 E-0.1\nG0 X10 Y10\nG1 Y16 E0.2\n", {});
  ASSERT_EQ(sheet.strokes.size(), 1U);
  EXPECT_NEAR(sheet.strokes[0].points.front().centre.y_mm, 13, 1e-6);
  ASSERT_EQ(sheet.notes.size(), 1U);
  EXPECT_THAT(sheet.notes[0], HasSubstr("retracted"));
}

TEST(SheetPrint, StringsBulgesMotorErrorAndCouplingShow) {
  SheetMachine machine;
  machine.tools[0].string_share = 1;
  machine.start_bulge_mm = 0.1;
  machine.motor[0] = {0.01, 0.8, 0};
  const std::string retract = "G1 E-1\nG0 X50\nG1 E1\n";
  const PrintedSheet sheet = Printed(LinesAlongY(2, 0.2, -2) + retract, machine);
  ASSERT_EQ(sheet.strokes.size(), 4U);
  EXPECT_FALSE(sheet.strokes[1].raised);
  EXPECT_FALSE(sheet.strokes[3].raised);
  const InkStroke& line = sheet.strokes[0];
  EXPECT_NEAR(line.points.front().left_mm - line.points[60].left_mm, 0.05, 1e-6);
  EXPECT_NEAR(MeanX(line), 0.21, kExactMm);  // a quarter of the motor's cycle
  machine = {};
  machine.coupling_mm = 0.02;
  std::string gcode = "M83\n";
  for (int i = 0; i < 100; ++i) gcode += "T1\nG0 X0 Y0\nT0\nG0 X10 Y0\nG1 Y6 E0.2\n";
  std::vector<double> place;
  for (const InkStroke& stroke : Printed(gcode, machine).strokes) place.push_back(MeanX(stroke));
  EXPECT_NEAR(StandardDeviation(place), 0.02, 4 * 0.02 / std::sqrt(2 * 100.0)) << "seed " << kSeed;
}

TEST(SheetPrint, RefusesSheetsWithoutLinesAndFieldsOutOfBounds) {
  const auto error_of = [](const std::string& gcode, const SheetMachine& machine) {
    const auto sheet = PrintSheet(*InterpretSheet(gcode, {}), machine, {}, Random(kSeed));
    return sheet ? std::string("no error") : sheet.error().message;
  };
  EXPECT_THAT(error_of("G1 X10", {}), HasSubstr("no line"));
  EXPECT_THAT(error_of("M83\nG1 Z2\nG1 X10 E1", {}), HasSubstr("no line"));
  SheetMachine machine;
  machine.backlash_mm[1] = std::nan("");
  EXPECT_THAT(error_of("M83\nG1 X10 E1", machine), HasSubstr("backlash_mm.y is nan"));
}

TEST(SheetPrint, AFoldBringsBothSidesTogetherByWhatItTakesUp) {
  SheetPaper paper;
  paper.folds.push_back({{20, 0}, std::numbers::pi / 2, 0.2, 0.5, 0});
  const PrintedSheet sheet = Printed(LinesAlongY(8, 10, -2), {}, paper);
  ASSERT_EQ(sheet.strokes.size(), 8U);
  EXPECT_NEAR(MeanX(sheet.strokes.front()), 10.1, 1e-6);
  EXPECT_NEAR(MeanX(sheet.strokes.back()), 37.9, 1e-6);
}

TEST(SheetPrint, HairsAndCreasesAreDirtThatLiesOnThePrint) {
  SheetPaper paper;
  paper.folds.push_back({{20, 13}, 0, 0, 1, 0.5});
  paper.hair_count = 3;
  const PrintedSheet sheet = Printed(LinesAlongY(8, 10, -2), {}, paper);
  std::size_t dirt = 0;
  for (const InkStroke& stroke : sheet.strokes) dirt += stroke.ink == kDirtInk ? 1 : 0;
  EXPECT_GT(dirt, 3 * 39U);                            // pieces of 0.5 mm, 20 mm of each at least
  EXPECT_EQ(sheet.strokes.back().points.size(), 28U);  // the crease, in steps of 1 mm, x 10 ... 38
}

TEST(SheetPrint, AThinToolLetsPaperThroughAndAShareOfItsLinesDoesNotStick) {
  SheetMachine machine;
  machine.tools[0].opacity = 0.3;
  machine.tools[0].missing_share = 0.25;
  const PrintedSheet sheet = Printed(LinesAlongY(400, 10, -2), machine);
  EXPECT_NEAR(static_cast<double>(sheet.strokes.size()), 300, 4 * std::sqrt(400 * 0.25 * 0.75));
  for (const InkStroke& stroke : sheet.strokes) EXPECT_EQ(stroke.opacity, 0.3);
}

}  // namespace
}  // namespace trammel::sim
