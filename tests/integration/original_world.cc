#include "original_world.h"

#include <cmath>
#include <cstddef>
#include <numbers>
#include <numeric>
#include <stdexcept>

#include "tool_offset/original/original_gcode.h"

namespace trammel {
namespace {

constexpr double kTurn_rad = 4 * std::numbers::pi / 180;
constexpr double kMost_mm = 0.6;

/// Draws every tool's offset from the reference tool, along the print's own axes.
void DrawOffsets(const sim::OriginalSheet& sheet, Random& random, sim::SheetMachine& machine) {
  const double c = std::cos(sheet.rotation_rad);
  const double s = std::sin(sheet.rotation_rad);
  for (sim::SheetTool& tool : machine.tools) {
    const double u_mm = random.Uniform(-kMost_mm, kMost_mm);
    const double v_mm = random.Uniform(-kMost_mm, kMost_mm);
    tool.offset_mm = {c * u_mm - s * v_mm, s * u_mm + c * v_mm};
  }
  machine.tools[static_cast<std::size_t>(sheet.reference)].offset_mm = {};
}

}  // namespace

sim::OriginalSheet OriginalOf(int pairs) {
  sim::OriginalSheet sheet;
  sheet.tools.resize(static_cast<std::size_t>(pairs));
  std::iota(sheet.tools.begin(), sheet.tools.end(), 1);
  return sheet;
}

PatternFile OriginalPattern(const sim::OriginalSheet& sheet) {
  PatternFile pattern{{}, sim::OriginalGcode(sheet)};
  const auto read = tool_offset::ReadOriginalGcode(pattern.gcode);
  if (!read) throw std::runtime_error(read.error().message);
  pattern.plan = tool_offset::PlanOriginal(*read);
  return pattern;
}

SeenSheet SeeOriginal(const OriginalCase& what, std::uint64_t seed) {
  Random random = Random(seed).Fork(8'000'000);
  const PatternFile pattern{OriginalPattern(what.told).plan, sim::OriginalGcode(what.drawn)};
  return SeeSheet(
      pattern, {seed, 0, 0},
      [&](sim::SheetMachine& machine, sim::SheetPaper& paper) {
        DrawOffsets(what.drawn, random, machine);
        if (!what.drives) machine.motor = machine.pulley = {};
        if (what.machine) what.machine(random, machine, paper);
      },
      [&](sim::ScannerTraits& scanner) {
        scanner.rotation_rad =
            what.way % 4 * std::numbers::pi / 2 + random.Uniform(-kTurn_rad, kTurn_rad);
        scanner.mirrored = what.way >= 4;
        scanner.dpi = what.dpi;
        scanner.area_width_mm = scanner.area_height_mm = 0;
        scanner.shift_x_mm = scanner.shift_y_mm = 0;
        if (!what.drives) scanner.bar.clear();
        if (what.scanner) what.scanner(random, scanner);
      });
}

}  // namespace trammel
