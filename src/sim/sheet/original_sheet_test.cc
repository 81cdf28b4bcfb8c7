#include "sim/sheet/original_sheet.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <set>

#include "sim/sheet/sheet_print.h"

namespace trammel::sim {
namespace {

constexpr double kFileMm = 0.001;  // three decimals in the file, turned: 0.5 um in x and in y
constexpr int kLegsOfAComb = 33;   // 17 fingers of two legs, of which the first is a travel

struct Stretch {
  int tool = 0;
  PlaneMm from;
  PlaneMm to;
  double e_mm = 0;
};

SheetProgram Program(const OriginalSheet& sheet) {
  const std::string gcode = OriginalGcode(sheet);
  SheetSetup setup;
  setup.firmware = GuessSheetFirmware(gcode);
  EXPECT_EQ(setup.firmware, SheetFirmware::kRepRapFirmware);
  const auto program = InterpretSheet(gcode, setup);
  EXPECT_TRUE(program) << (program ? "" : program.error().message);
  return program ? *program : SheetProgram{};
}

PlaneMm TurnedBack(const PlaneMm& bed, double rad) {
  return {std::cos(rad) * bed.x_mm + std::sin(rad) * bed.y_mm,
          std::cos(rad) * bed.y_mm - std::sin(rad) * bed.x_mm};
}

// Straight lines of ink along the print's own axes.
std::vector<Stretch> Straight(const OriginalSheet& sheet) {
  std::vector<Stretch> lines;
  for (const SheetMove& move : Program(sheet).moves) {
    if (move.arc || move.e_mm <= 0) continue;
    const Stretch line{move.tool, TurnedBack(move.from, sheet.rotation_rad),
                       TurnedBack(move.to, sheet.rotation_rad), move.e_mm};
    if (std::hypot(line.to.x_mm - line.from.x_mm, line.to.y_mm - line.from.y_mm) > 0.1) {
      lines.push_back(line);
    }
  }
  return lines;
}

double LengthOf(const Stretch& line) {
  return std::hypot(line.to.x_mm - line.from.x_mm, line.to.y_mm - line.from.y_mm);
}

std::vector<Stretch> Legs(const OriginalSheet& sheet, int tool, bool along_u) {
  std::vector<Stretch> legs;
  for (const Stretch& line : Straight(sheet)) {
    const bool flat = std::abs(line.to.y_mm - line.from.y_mm) < 0.01;
    if (line.tool == tool && flat == along_u && std::abs(LengthOf(line) - 6) < 2 * kFileMm) {
      legs.push_back(line);
    }
  }
  return legs;
}

TEST(OriginalSheet, BoxHasThePublishedSizeForEveryNumberOfTools) {
  const double sizes[][2] = {{122, 78}, {144, 78}, {166, 95}, {188, 117}};
  for (int count = 2; count <= 5; ++count) {
    OriginalSheet sheet;
    sheet.tools.resize(static_cast<std::size_t>(count));
    double most_u = 0;
    double most_v = 0;
    for (const Stretch& line : Straight(sheet)) {
      most_u = std::max(most_u, line.to.x_mm);
      most_v = std::max(most_v, line.to.y_mm);
    }
    EXPECT_NEAR(2 * most_u, sizes[count - 2][0], 2 * kFileMm) << count;
    EXPECT_NEAR(2 * most_v, sizes[count - 2][1], 2 * kFileMm) << count;
  }
}

TEST(OriginalSheet, EachCombHasThirtyThreeLegs) {
  OriginalSheet sheet;
  sheet.tools = {1, 3};
  for (const bool along_u : {false, true}) {
    EXPECT_EQ(Legs(sheet, 1, along_u).size(), 2U * kLegsOfAComb);
    EXPECT_EQ(Legs(sheet, 3, along_u).size(), 2U * kLegsOfAComb);
    EXPECT_EQ(Legs(sheet, 2, along_u).size(), 4U * kLegsOfAComb);
  }
}

TEST(OriginalSheet, LegsStandWhereItWasPublished) {
  const OriginalSheet sheet;  // five tools: y-structures from u = -90, x-structures from v = -53.5
  const std::vector<Stretch> legs = Legs(sheet, 1, true);
  // "+": first leg drawn is the return of the first finger, from cross 6 to the spine at 0.
  EXPECT_NEAR(legs[0].from.x_mm, -90 + 6, kFileMm);
  EXPECT_NEAR(legs[0].to.x_mm, -90, kFileMm);
  EXPECT_NEAR(legs[0].to.y_mm, -35 + 0.75, kFileMm);
  EXPECT_NEAR(legs[1].to.y_mm, -35 + 4, kFileMm);
  // "-" begins a period beyond the end and steps down, 11 mm further on.
  const Stretch& minus = legs[kLegsOfAComb];
  EXPECT_NEAR(minus.to.x_mm, -90 + 11, kFileMm);
  EXPECT_NEAR(minus.to.y_mm, -35 + 68, kFileMm);
  EXPECT_NEAR(legs[kLegsOfAComb + 1].to.y_mm, -35 + 68.75 - 4, kFileMm);
  // References: from cross 2 to their spine at 8.
  const std::vector<Stretch> references = Legs(sheet, 2, true);
  EXPECT_NEAR(references[0].from.x_mm, -90 + 2, kFileMm);
  EXPECT_NEAR(references[0].to.x_mm, -90 + 8, kFileMm);
  EXPECT_NEAR(references[0].to.y_mm, -35 + 2.75, kFileMm);
  const std::vector<Stretch> upright = Legs(sheet, 5, false);
  EXPECT_NEAR(upright[0].to.x_mm, 20 + 0.75, kFileMm);
  EXPECT_NEAR(upright[0].to.y_mm, -53.5 + 4 * 22, kFileMm);
}

TEST(OriginalSheet, TurnsAreHalfCirclesOnTheFarSideOfTheLegs) {
  OriginalSheet sheet;
  sheet.tools = {1};
  sheet.rotation_rad = 0;
  double most_u = -1e9;
  double least_u = 1e9;
  for (const SheetMove& move : Program(sheet).moves) {
    if (!move.arc || move.tool != 1 || move.to.x_mm > -25) continue;
    most_u = std::max(most_u, move.to.x_mm);
    least_u = std::min(least_u, move.to.x_mm);
  }
  // x-structures lie right of u = 46 - 70. y-structures from u = -(19 + 73) / 2 = -46: the second
  // one's tips at -46 + 11 + 6, and 0.375 beyond; the first one's spine 0.375 before it. Chords
  // miss the outermost point by their sag.
  EXPECT_NEAR(most_u, -46 + 17 + 0.375, 2 * kFileMm);
  EXPECT_NEAR(least_u, -46 - 0.375, 2 * kFileMm);
}

TEST(OriginalSheet, LinesCarryTheStatedFilament) {
  // 1.1 x 0.4 x 0.2 mm2 through a filament of 1.75 mm.
  const double per_mm = 0.088 / (M_PI * 0.875 * 0.875);
  const std::vector<Stretch> legs = Legs(OriginalSheet{}, 1, true);
  ASSERT_FALSE(legs.empty());
  EXPECT_NEAR(legs[0].e_mm, 6 * per_mm, 1e-5);
}

TEST(OriginalSheet, AsPublishedTheLastOffsetMovesEverything) {
  OriginalSheet moved;
  moved.tools = {1, 3};
  const OriginalSheet plain = moved;
  moved.offsets = {{0.3, 0.2}, {0.1, -0.1}};
  for (const int tool : {1, 2, 3}) {
    const auto before = Legs(plain, tool, true);
    const auto after = Legs(moved, tool, true);
    ASSERT_EQ(before.size(), after.size());
    EXPECT_NEAR(after[0].to.x_mm - before[0].to.x_mm, 0.1, 2 * kFileMm) << tool;
    EXPECT_NEAR(after[0].to.y_mm - before[0].to.y_mm, -0.1, 2 * kFileMm) << tool;
  }
  moved.repaired = true;
  const auto shift = [&](int tool) {
    return Legs(moved, tool, true)[0].to.x_mm - Legs(plain, tool, true)[0].to.x_mm;
  };
  EXPECT_NEAR(shift(1), 0.3, 2 * kFileMm);
  EXPECT_NEAR(shift(2), 0, 2 * kFileMm);
  EXPECT_NEAR(shift(3), 0.1, 2 * kFileMm);
}

// A turn goes on from its legs: neither has a bulge between them.
TEST(OriginalSheet, SerpentinesBulgeAtTheirEndsAlone) {
  OriginalSheet sheet;
  sheet.tools = {1};
  SheetMachine machine;
  machine.start_bulge_mm = machine.end_bulge_mm = 0.1;
  const auto printed = PrintSheet(Program(sheet), machine, SheetPaper{}, Random(1));
  ASSERT_TRUE(printed);
  std::size_t bulging = 0;
  for (const InkStroke& stroke : printed->strokes) {
    if (stroke.ink != 1) continue;
    const double middle = stroke.points[stroke.points.size() / 2].left_mm;
    bulging += stroke.points.front().left_mm > middle + 0.03 ? 1 : 0;
  }
  // Four combs begin with a half turn whose first chord alone may bulge.
  EXPECT_LE(bulging, 4U);
}

TEST(OriginalSheet, ImpossibleSheetsAreRefused) {
  OriginalSheet sheet;
  sheet.tools = {8};
  EXPECT_FALSE(Validate(sheet));
  sheet.tools = {1, 2};
  sheet.offsets = {{0, 0}};
  EXPECT_FALSE(Validate(sheet));
  EXPECT_FALSE(ParseOriginalTools("1,2,x"));
  EXPECT_FALSE(ParseOriginalTools("1,2,3,4,5,6"));
  EXPECT_FALSE(ParseOriginalTools(""));
  EXPECT_EQ(*ParseOriginalTools("2,2,1"), (std::vector<int>{2, 2, 1}));
}

TEST(OriginalSheet, ArcsWhoseRadiiDisagreeAreRefused) {
  SheetSetup setup;
  setup.firmware = SheetFirmware::kRepRapFirmware;
  EXPECT_FALSE(InterpretSheet("G2 X1 Y1 I2 J0 E1", setup));
  EXPECT_FALSE(InterpretSheet("G2 X1 Y1 R1 E1", setup));
  EXPECT_TRUE(InterpretSheet("T0\nM83\nG3 X1 Y1 I0 J1 E1", setup));
}

}  // namespace
}  // namespace trammel::sim
