#include "sim/sheet/original_sheet.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "sim/sheet/sheet_print.h"

namespace trammel::sim {
namespace {

constexpr double kFileMm = 0.001;  // three decimals in the file, turned: 0.5 um in x and in y

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
    double max_u = 0;
    double max_v = 0;
    for (const Stretch& line : Straight(sheet)) {
      max_u = std::max(max_u, line.to.x_mm);
      max_v = std::max(max_v, line.to.y_mm);
    }
    EXPECT_NEAR(2 * max_u, sizes[count - 2][0], 2 * kFileMm) << count;
    EXPECT_NEAR(2 * max_v, sizes[count - 2][1], 2 * kFileMm) << count;
  }
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

}  // namespace
}  // namespace trammel::sim
