// Print, scan, read, correct, print again: the offset is gone, in each firmware's own arithmetic.
#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <sstream>
#include <string>

#include "base/page.h"
#include "base/random.h"
#include "offset_world.h"
#include "sim/scanner/scanner_page.h"
#include "sim/sheet/sheet_firmware.h"
#include "sim/sheet/sheet_gcode.h"
#include "sim/sheet/sheet_print.h"
#include "support/matchers.h"
#include "tool_offset/offset/analyse.h"
#include "tool_offset/offset/correction.h"
#include "tool_offset/sheet/sheet_gcode.h"

namespace trammel {
namespace {

using tool_offset::KeptOffset;
using tool_offset::OffsetFirmware;

// Twice what 95 % of single readings err by at most (offset_study): two sheets differ by more than
// one errs.
constexpr double kGone_mm = 0.005;

struct Firmware {
  OffsetFirmware firmware;
  gcode::Dialect dialect;
  sim::SheetFirmware machine;
};

class RoundTrip : public testing::TestWithParam<Firmware> {
 protected:
  // Macros of the machine for T1, if its offset is in the tool's own macro.
  static sim::SheetMacros Macros(const KeptOffset& kept) {
    const auto macros = sim::ParseSheetMacros(
        fmt::format("[gcode_macro T0]\ngcode:\n  ACTIVATE_EXTRUDER EXTRUDER=extruder\n"
                    "  SET_GCODE_OFFSET X=0 Y=0\n"
                    "[gcode_macro T1]\ngcode:\n  ACTIVATE_EXTRUDER EXTRUDER=extruder1\n  {}\n",
                    SetCommands(OffsetFirmware::kKlipperGcodeOffset, 1, kept).front()));
    if (!macros) throw std::runtime_error(macros.error().message);
    return *macros;
  }

  // Reads tool 1 off a sheet that was printed with the kept offset.
  tool_offset::ToolReading Read(const KeptOffset& kept, std::uint64_t sheet) {
    tool_offset::SheetSettings settings;
    settings.printer.dialect = GetParam().dialect;
    settings.filament.material = "pla";
    const tool_offset::SheetPlan plan = tool_offset::PlanSheet(settings);
    sim::SheetSetup setup;
    setup.firmware = GetParam().machine;
    if (GetParam().firmware == OffsetFirmware::kKlipperGcodeOffset) {
      setup.macros = Macros(kept);
    } else {
      if (GetParam().firmware == OffsetFirmware::kKlipperTool) setup.stored[1] = sim::PlaneMm{};
      for (const std::string& line : SetCommands(GetParam().firmware, 1, kept)) {
        setup.before += line + "\n";
      }
    }
    const auto program = sim::InterpretSheet(tool_offset::WriteSheetGcode(plan).text, setup);
    if (!program) throw std::runtime_error(program.error().message);
    const sim::SheetName name = {77, sheet, 0};
    const auto scene = sim::SheetScene::kBlackOnWhite;
    const auto printed = sim::PrintSheet(*program, sim::MachineOf(name, scene),
                                         sim::PaperOf(name, scene), sim::PrintingOf(name));
    if (!printed) throw std::runtime_error(printed.error().message);
    const auto scan =
        sim::ScanSheet(*printed, sim::ScannerOf(name, *printed), sim::ScanningOf(name));
    if (!scan) throw std::runtime_error(scan.error().message);
    const auto result = tool_offset::AnalyseSheet(
        {scan->samples.data(), scan->format.width_px, scan->format.height_px, 1,
         static_cast<std::ptrdiff_t>(scan->format.row_bytes())},
        plan);
    if (!result) throw std::runtime_error(result.error().message);
    return result->tools.front();
  }
};

TEST_P(RoundTrip, AnOffsetIsGoneOnTheNextSheetOneTenMillimetresOffOnTheThird) {
  constexpr double kCoarse_mm = 0.2;  // what a sheet may leave of an offset far off
  const struct {
    KeptOffset kept;
    std::vector<double> within_mm;  // of each sheet after the first
  } rows[] = {{{0.05, -0.08}, {kGone_mm}}, {{-6.4, 8.9}, {kCoarse_mm, kGone_mm}}};
  std::uint64_t sheet = 0;
  for (const auto& row : rows) {
    KeptOffset kept = row.kept;
    for (std::size_t i = 0; i <= row.within_mm.size(); ++i) {
      SCOPED_TRACE(sheet);
      const tool_offset::ToolReading read = Read(kept, sheet++);
      ASSERT_TRUE(read.dx_mm.good()) << read.dx_mm.reason();
      ASSERT_TRUE(read.dy_mm.good()) << read.dy_mm.reason();
      const double dx_mm = read.dx_mm.quantity().value;
      const double dy_mm = read.dy_mm.quantity().value;
      EXPECT_EQ(read.coarse, i == 0 && row.within_mm.size() > 1);
      if (i == 0) {
        EXPECT_GT(std::hypot(dx_mm, dy_mm), 10 * kGone_mm);  // something to take out
      } else {
        EXPECT_NEAR(dx_mm, 0, row.within_mm[i - 1]);
        EXPECT_NEAR(dy_mm, 0, row.within_mm[i - 1]);
      }
      kept = Corrected(GetParam().firmware, kept, dx_mm, dy_mm);
    }
  }
}

INSTANTIATE_TEST_SUITE_P(
    Firmwares, RoundTrip,
    testing::Values(Firmware{OffsetFirmware::kKlipperTool, gcode::Dialect::kKlipper,
                             sim::SheetFirmware::kKlipper},
                    Firmware{OffsetFirmware::kKlipperGcodeOffset, gcode::Dialect::kKlipper,
                             sim::SheetFirmware::kKlipper},
                    Firmware{OffsetFirmware::kMarlin, gcode::Dialect::kMarlin,
                             sim::SheetFirmware::kMarlin},
                    Firmware{OffsetFirmware::kRepRapFirmware, gcode::Dialect::kRepRapFirmware,
                             sim::SheetFirmware::kRepRapFirmware}),
    [](const auto& tested) {
      std::string name(ToString(tested.param.firmware));
      std::replace(name.begin(), name.end(), '-', '_');
      return name;
    });

TEST(OffsetSheet, EightToolsOnA4AreAllReadToTheirIntervals) {
  const PatternFile pattern = SheetOfTools(8);
  ASSERT_TRUE(tool_offset::FitsItsPaper(pattern.plan));
  const SeenSheet seen =
      SeeSheet(pattern, {78, 0, 0},
               [](sim::SheetMachine& machine, sim::SheetPaper&) {
                 machine.tools[5].offset_mm = {-4.3, 7.7};  // one of them far off
               },
               {});
  ASSERT_TRUE(seen.result) << seen.result.error().message;
  ASSERT_EQ(seen.result->tools.size(), 7U);
  for (const tool_offset::ToolReading& tool : seen.result->tools) {
    const auto truth = Must(sim::OffsetOf(seen.sheet, tool.tool, 0));
    ASSERT_TRUE(tool.dx_mm.good()) << tool.dx_mm.reason();
    ASSERT_TRUE(tool.dy_mm.good()) << tool.dy_mm.reason();
    EXPECT_EQ(tool.coarse, tool.tool == 5);
    // Twice the 95 % interval: 14 values, none of which may be wrong.
    const auto half = [](const Measured& m) {
      return m.quantity().interval95.hi - m.quantity().interval95.lo;
    };
    EXPECT_NEAR(tool.dx_mm.quantity().value, truth.x_mm, half(tool.dx_mm)) << tool.tool;
    EXPECT_NEAR(tool.dy_mm.quantity().value, truth.y_mm, half(tool.dy_mm)) << tool.tool;
  }
}

// Reads a sheet of seven tools that print up to 12 mm off, drawn as offset_study draws it, and
// counts the tools that are answered: each has to be right.
int CountRightAnswers(std::uint64_t seed) {
  Random random = Random(seed).Fork(7'000'000);
  const SeenSheet seen = SeeSheet(SheetOfTools(7), {seed, 0, 0},
                                  [&](sim::SheetMachine& machine, sim::SheetPaper&) {
                                    for (std::size_t tool = 1; tool < 7; ++tool) {
                                      const double far_mm = random.Uniform(0, 12);
                                      const double other_mm = random.Uniform(-far_mm, far_mm);
                                      const double sign = random.Below(2) == 0 ? 1 : -1;
                                      machine.tools[tool].offset_mm =
                                          random.Below(2) == 0
                                              ? sim::PlaneMm{sign * far_mm, other_mm}
                                              : sim::PlaneMm{other_mm, sign * far_mm};
                                    }
                                  },
                                  {});
  if (!seen.result) return 0;
  constexpr double kRight_mm = 0.1;
  int answered = 0;
  for (const tool_offset::ToolReading& tool : seen.result->tools) {
    const auto truth = sim::OffsetOf(seen.sheet, tool.tool, 0);
    if (!truth || !tool.dx_mm.good() || !tool.dy_mm.good()) continue;
    EXPECT_NEAR(tool.dx_mm.quantity().value, truth->x_mm, kRight_mm) << "T" << tool.tool;
    EXPECT_NEAR(tool.dy_mm.quantity().value, truth->y_mm, kRight_mm) << "T" << tool.tool;
    ++answered;
  }
  return answered;
}

// Lines of two tools together have all legs of one at a third place, where one comb is too faint.
TEST(OffsetSheet, ATooFaintCombTellsThatLinesAreAnotherTools) {
  EXPECT_GE(CountRightAnswers(621084), 3);
}

// Two tools hide each other's fingers, and lie over those of a third.
TEST(OffsetSheet, LinesOfToolsThatCannotBeReadSpoilNoOthers) {
  EXPECT_GE(CountRightAnswers(621092), 3);
}

TEST(OffsetPattern, OnAKlipperWithoutPauseResumeEndsColdInsteadOfRunningOn) {
  tool_offset::SheetSettings settings;
  settings.filament.material = "pla";
  const std::string gcode = tool_offset::WriteSheetGcode(tool_offset::PlanSheet(settings)).text;
  sim::SheetSetup setup;
  EXPECT_TRUE(sim::InterpretSheet(gcode, setup));
  setup.pause_resume = false;
  EXPECT_THAT(sim::InterpretSheet(gcode, setup),
              FailsWith("RESTORE_GCODE_STATE without a saved state"));
  // Up to that line nothing is heated.
  std::istringstream lines(gcode);
  std::string line;
  while (std::getline(lines, line) && line != "PAUSE") {
    EXPECT_FALSE(line.starts_with("M109") || line.starts_with("M190")) << line;
  }
}

}  // namespace
}  // namespace trammel
