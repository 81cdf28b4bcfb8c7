#include "tool_offset/reading/code_reader.h"

#include <algorithm>
#include <numeric>

#include "tool_offset/sheet/sheet_code.h"

namespace trammel::tool_offset {
namespace {

/// The most ink along v that a line's width near the cell's middle holds, above the paper beside.
double LegInk(const PageView& page, const ChannelMix& mix, const SheetPlan& plan,
              const LocalMap& local) {
  constexpr double kRowHalf_mm = 1.2;  // of the leg's 4 mm
  constexpr double kRowStep_mm = 0.1;
  constexpr double kHalf_mm = 0.9;  // of the cell's 2 mm
  Strip strip;
  const double step_mm = 1 / Length(local.u_px_mm);
  strip.rows = static_cast<int>(2 * kRowHalf_mm / kRowStep_mm) + 1;
  strip.columns = static_cast<int>(2 * kHalf_mm / step_mm) + 1;
  strip.row_step = kRowStep_mm * local.v_px_mm;
  strip.column_step = step_mm * local.u_px_mm;
  strip.origin = local.ToPage(-kHalf_mm, -kRowHalf_mm);
  std::vector<float> samples;
  if (!SampleStrip(page, mix, strip, samples)) return 0;
  const auto columns = static_cast<std::size_t>(strip.columns);
  std::vector<float> profile(columns, 0);
  for (std::size_t i = 0; i < samples.size(); ++i) {
    profile[i % columns] += samples[i] / static_cast<float>(strip.rows);
  }
  const auto width = std::clamp<std::size_t>(
      static_cast<std::size_t>(plan.settings.line_width_mm / step_mm), 1, columns);
  double most = -1e9;
  for (std::size_t first = 0; first + width <= columns; ++first) {
    const double sum =
        std::accumulate(profile.begin() + static_cast<std::ptrdiff_t>(first),
                        profile.begin() + static_cast<std::ptrdiff_t>(first + width), 0.0);
    most = std::max(most, sum / static_cast<double>(width));
  }
  const auto middle = profile.begin() + static_cast<std::ptrdiff_t>(columns / 2);
  std::nth_element(profile.begin(), middle, profile.end());
  return most - static_cast<double>(*middle);
}

int MissingCells(const CodeReading& code, const SheetPlan& plan) {
  int missing = 0;
  for (std::size_t i = 0; i < plan.code.size(); ++i) {
    missing += plan.code[i].dark && !code.dark[i] ? 1 : 0;
  }
  return missing;
}

}  // namespace

CodeReading ReadCode(const PageView& page, const ChannelMix& mix, const SheetPlan& plan,
                     const PageMap& map) {
  constexpr std::size_t kSure = 5;  // every code has more dark and light cells than this
  CodeReading reading;
  for (const CodeCell& cell : plan.code) {
    reading.ink.push_back(LegInk(page, mix, plan, map.Near(cell.middle)));
  }
  std::vector<double> sorted = reading.ink;
  if (sorted.size() < 2 * kSure) return reading;
  std::sort(sorted.begin(), sorted.end());
  const double light = sorted[kSure / 2];
  const double dark = sorted[sorted.size() - 1 - kSure / 2];
  reading.contrast = dark - light;
  CodeCells cells{};
  for (std::size_t i = 0; i < reading.ink.size(); ++i) {
    reading.dark.push_back(reading.ink[i] > (light + dark) / 2);
    if (reading.dark[i] != plan.code[i].dark) ++reading.wrong_cells;
    if (i < cells.size()) cells[i] = reading.dark[i];
  }
  if (plan.code.size() == kCodeCells) {
    if (const auto id = DecodeSheetId(cells)) reading.sheet_id = *id;
  }
  return reading;
}

bool IsThisCode(const CodeReading& code, const SheetPlan& plan) {
  constexpr int kDamaged = 2;           // cells, when all the others say that it is this sheet
  constexpr int kBroken = 4;            // dark cells of 34 whose lines did not stick, none added
  constexpr int kMissing = 1;           // dark cells of 34 that may have lost their ink
  constexpr double kPrintedOver = 0.7;  // of the light ones
  if (code.wrong_cells <= kDamaged) return true;
  const auto light = std::count_if(plan.code.begin(), plan.code.end(),
                                   [](const CodeCell& cell) { return !cell.dark; });
  const int missing = MissingCells(code, plan);
  const int added = code.wrong_cells - missing;
  if (added == 0) return missing <= kBroken;
  return missing <= kMissing && added <= kPrintedOver * static_cast<double>(light);
}

bool IsBrokenCode(const CodeReading& code, const SheetPlan& plan) {
  constexpr int kFewest = 8;  // dark cells that chance finds among the plan's once in 256 times
  const int missing = MissingCells(code, plan);
  const auto dark = std::count(code.dark.begin(), code.dark.end(), true);
  return missing == code.wrong_cells && dark >= kFewest;
}

}  // namespace trammel::tool_offset
