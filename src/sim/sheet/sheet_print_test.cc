#include "sim/sheet/sheet_print.h"

#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <string>
#include <vector>

#include "base/statistics.h"

namespace trammel::sim {
namespace {

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

}  // namespace
}  // namespace trammel::sim
