#include "tool_offset/code_reader.h"

#include <algorithm>
#include <numeric>

#include "tool_offset/sheet_code.h"

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

}  // namespace trammel::tool_offset
