// Draws height maps of all lines from above (figures 7 to 9).
#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>

#include "base/statistics.h"
#include "document/interval_text.h"
#include "pressure_advance/report/pressure_advance_figures.h"

namespace trammel::report {
namespace {

namespace pa = pressure_advance;

constexpr std::size_t kMaxMaps = 24;
constexpr double kBarRoomPx = 78;
constexpr double kAxisPx = 44;

// The maps to show: of the response eye, or of the paper's method where there are none.
const std::vector<pa::HeightMap>* ShownHeights(const AnalysisRun& input) {
  if (!input.scan) {
    return nullptr;
  }
  const auto& maps = input.scan->heights.empty() ? input.scan->paper_heights : input.scan->heights;
  return maps.empty() ? nullptr : &maps;
}

// One image row per row and one column per frame; NaN where no laser line was found. Empty where
// the map's sizes do not fit its values.
Grid HeightGrid(const pa::HeightMap& map) {
  if (map.frames == 0 || map.rows == 0 || map.height_px.size() != map.frames * map.rows ||
      map.sigma_px.size() != map.height_px.size()) {
    return {};
  }
  Grid grid{map.frames, map.rows, std::vector<double>(map.height_px.size())};
  for (std::size_t row = 0; row < map.rows; ++row) {
    for (std::size_t frame = 0; frame < map.frames; ++frame) {
      const std::size_t at = map.index(frame, row);
      grid.values[row * map.frames + frame] = map.sigma_px[at] > 0
                                                  ? static_cast<double>(map.height_px[at])
                                                  : std::numeric_limits<double>::quiet_NaN();
    }
  }
  return grid;
}

// Unit of heights: mm if the scan's scale is known.
struct HeightUnit {
  double per_px = 1;
  const char* label = "height (px)";
};

HeightUnit HeightUnitOf(const AnalysisRun& input) {
  const auto& scale = input.analysis.scale;
  // The heights of the paper's method do not begin at the plate.
  if (!scale || !input.scan || input.scan->heights.empty()) return {};
  return {scale->height_mm_per_px, "height (mm)"};
}

// Uncertainty of heights and areas in mm, as a sentence with a leading blank; empty if they are in
// pixels.
std::string ScaleText(const pa::Analysis& analysis) {
  const auto& scale = analysis.scale;
  if (!scale) return "";
  if (!scale->height_share || !scale->area_share) {
    return " How well scale and laser angle are known was not said: trammel pa setup measures "
           "both.";
  }
  return fmt::format(
      " Scale and laser angle leave {:.2g} % of all heights and {:.2g} % of all areas open alike "
      "(half of the 95 % interval); beads may be higher and larger than they are read, by a "
      "quarter "
      "where light enters the filament. Neither moves a pressure advance.",
      100 * kNormal95 * *scale->height_share, 100 * kNormal95 * *scale->area_share);
}

// From the 1st to the 99th percentile of all maps, so that single outliers do not take the scale.
Range HeightRange(const std::vector<pa::HeightMap>& maps) {
  std::vector<double> seen;
  for (const pa::HeightMap& map : maps) {
    for (const double height : HeightGrid(map).values) {
      if (std::isfinite(height)) {
        seen.push_back(height);
      }
    }
  }
  if (seen.empty()) {
    return {0, 1};
  }
  const double ends[] = {Quantile(seen, 0.01), Quantile(seen, 0.99)};
  return RangeOf(ends);
}

// The axis along a map: positions in mm where known, else frame numbers.
Axis AxisAlong(const pa::HeightMap& map) {
  if (map.position_mm.size() == map.frames && map.frames >= 2) {
    return {"position along the line (mm)", RangeOf(map.position_mm)};
  }
  return {"frame", {0, static_cast<double>(std::max<std::size_t>(1, map.frames))}};
}

void DrawMap(Canvas& canvas, const RectPx& inner, const pa::HeightMap& map, const Range& heights,
             bool with_axis, const std::string& title) {
  Axis along = AxisAlong(map);
  if (!with_axis) along.label.clear();
  along.ticks = canvas.width_px() < kFigureWidthPx ? 4 : 6;
  along.shown = with_axis;
  (void)Plot::Around(canvas, inner, along, {.label = "", .range = {0, 1}, .shown = false}, title);
  canvas.Image(ColorGrid(HeightGrid(map), heights).view(), inner);
  canvas.StrokeRect(inner, {.color = kMuted, .width_px = 1});
}

Range InUnit(const Range& heights_px, const HeightUnit& unit) {
  return {heights_px.lo * unit.per_px, heights_px.hi * unit.per_px};
}

std::string MapTitle(const pa::Analysis& analysis, std::size_t line) {
  std::string title = "PA " + PressureAdvanceText(analysis.lines[line].pressure_advance_s) + " s";
  const auto& scores = analysis.deviation.score_px;
  if (line < scores.size() && scores[line] && std::isfinite(*scores[line])) {
    title += fmt::format(" · deviation {:.1f} px", *scores[line]);
  }
  return title;
}

std::string Titles(const pa::Analysis& analysis, const std::vector<std::size_t>& lines) {
  std::string text;
  for (const std::size_t line : lines) {
    text += (text.empty() ? "" : "; ") + MapTitle(analysis, line);
  }
  return text;
}

/// Returns those of the chosen lines that have a map.
std::vector<std::size_t> WithMap(const std::vector<std::size_t>& lines,
                                 const std::vector<pa::HeightMap>& maps) {
  std::vector<std::size_t> kept;
  for (const std::size_t line : lines) {
    if (line < maps.size() && !HeightGrid(maps[line]).values.empty()) {
      kept.push_back(line);
    }
  }
  return kept;
}

/// Draws two columns, or one if there is no room.
Canvas DrawMaps(const pa::Analysis& analysis, const std::vector<pa::HeightMap>& maps,
                const std::vector<std::size_t>& lines, const HeightUnit& unit, double width_px) {
  constexpr double kPitchPx = 96;
  constexpr double kTitlePx = 24;
  const std::size_t columns = width_px < kFigureWidthPx ? 1 : 2;
  const Range heights = HeightRange(maps);
  const std::size_t rows = (lines.size() + columns - 1) / columns;
  Canvas canvas(width_px, kPitchPx * static_cast<double>(rows) + kAxisPx);
  const double width = (width_px - kBarRoomPx) / static_cast<double>(columns);
  for (std::size_t i = 0; i < lines.size(); ++i) {
    const std::size_t row = i % rows;  // down the first column, then down the second
    const std::size_t column = i / rows;
    const bool lowest = row + 1 == rows || i + 1 == lines.size();
    const RectPx inner{static_cast<double>(column) * width + 10,
                       static_cast<double>(row) * kPitchPx + kTitlePx, width - 24,
                       kPitchPx - kTitlePx - 6};
    DrawMap(canvas, inner, maps[lines[i]], heights, lowest, MapTitle(analysis, lines[i]));
  }
  DrawColorBar(
      canvas,
      {width_px - kBarRoomPx + 4, 26, 14, std::min(220.0, canvas.height_px() - kAxisPx - 30)},
      InUnit(heights, unit), unit.label);
  return canvas;
}

}  // namespace

std::optional<Figure> HeightMapsFigure(const AnalysisRun& input) {
  const std::vector<pa::HeightMap>* maps = ShownHeights(input);
  if (maps == nullptr) {
    return std::nullopt;
  }
  const pa::Analysis& analysis = input.analysis;
  const auto lines = WithMap(LinesByPressureAdvance(analysis, kMaxMaps), *maps);
  if (lines.empty()) {
    return std::nullopt;
  }
  const HeightUnit unit = HeightUnitOf(input);
  return Figure{"height_maps",
                "Every line from above, as the laser saw it: bright is high. Look for an even "
                "ridge. A ridge that thins or breaks after the speed-up and swells at the "
                "slow-down was printed with too little pressure advance; the other way round, with "
                "too much. Grey: no laser line found." +
                    ScaleText(analysis),
                DrawMaps(analysis, *maps, lines, unit, kFigureWidthPx),
                2,
                "Height maps of " + Titles(analysis, lines) + ".",
                DrawMaps(analysis, *maps, lines, unit, kNarrowWidthPx)};
}

}  // namespace trammel::report
