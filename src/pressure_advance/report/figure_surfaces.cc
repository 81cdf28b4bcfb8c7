// Three lines as relief (figure 6).
#include <fmt/format.h>

#include "document/surface.h"
#include "pressure_advance/report/figure_common.h"

namespace trammel::report {
namespace {

namespace pa = pressure_advance;

constexpr double kPanelPx = 205;
constexpr std::size_t kMostColumns = 60;
constexpr std::size_t kMostRows = 30;

/// One relief below the other; on a phone of fewer cells, which are no smaller there.
Canvas Draw(const pa::Analysis& analysis, const std::vector<pa::HeightMap>& maps,
            const std::vector<std::size_t>& lines, const HeightUnit& unit, double width_px) {
  const bool broad = width_px >= kFigureWidthPx;
  const Range heights = HeightRange(maps);
  Canvas canvas(width_px, kPanelPx * static_cast<double>(lines.size()));
  for (std::size_t i = 0; i < lines.size(); ++i) {
    const pa::HeightMap& map = maps[lines[i]];
    const MapExtent extent = ExtentOf(map);
    const double top = kPanelPx * static_cast<double>(i);
    DrawSurface(canvas, {0, top + 8, width_px - (broad ? 96 : 60), kPanelPx - 8},
                Smoothed(HeightGrid(map), broad ? kMostColumns : kMostColumns / 2,
                         broad ? kMostRows : kMostRows / 2),
                {extent.label,
                 unit.across,
                 extent.range,
                 {0, static_cast<double>(map.rows) * unit.across_per_px},
                 heights});
    canvas.Text({12, top + 22},
                "PA " + PressureAdvanceText(analysis.lines[lines[i]].pressure_advance_s) + " s",
                {.size_px = kTitleTextPx, .bold = true});
  }
  DrawColorBar(canvas, {width_px - 74, 24, 14, 120},
               {heights.lo * unit.per_px, heights.hi * unit.per_px}, unit.label);
  return canvas;
}

}  // namespace

std::optional<Figure> SurfacesFigure(const ReportInput& input) {
  const std::vector<pa::HeightMap>* maps = ShownHeights(input);
  if (maps == nullptr) {
    return std::nullopt;
  }
  const pa::Analysis& analysis = *input.analysis;
  std::vector<std::size_t> lines;
  for (const std::size_t line : TellingLines(analysis)) {
    if (line < maps->size() && (*maps)[line].frames >= 2 && (*maps)[line].rows >= 2 &&
        !HeightGrid((*maps)[line]).values.empty()) {
      lines.push_back(line);
    }
  }
  if (lines.empty()) {
    return std::nullopt;
  }
  return Figure{
      "surfaces",
      "The same three lines as relief, lowest pressure advance on top. Heights are "
      "exaggerated and lightly smoothed (a median over neighbours). A good line is a "
      "ridge of one height from end to end.",
      Draw(analysis, *maps, lines, HeightUnitOf(input), kFigureWidthPx),
      2,
      fmt::format("Relief of {} printed lines: ridges of height along each.", lines.size()),
      Draw(analysis, *maps, lines, HeightUnitOf(input), kNarrowWidthPx)};
}

}  // namespace trammel::report
