#include "pressure_advance/report/pattern_preview.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <numbers>
#include <set>
#include <string>
#include <vector>

#include "base/check.h"
#include "document/bed_plot.h"
#include "document/plot.h"
#include "settings/material.h"

namespace trammel::report {
namespace {

namespace pa = pressure_advance;

constexpr double kWidthPx = 1100;
constexpr double kHeightPx = 664;
constexpr double kTextPitchPx = 13;

constexpr Color kTravel = Rgb(0x9aa4b1);

bool Extrudes(const pa::Move& move) {
  return move.kind == pa::MoveKind::kFrame || move.kind == pa::MoveKind::kLine;
}

/// The speeds of all beads, slowest first.
std::vector<double> Speeds(const pa::PatternLayout& layout) {
  std::set<double> speeds;
  for (const pa::Move& move : layout.moves) {
    if (Extrudes(move)) {
      speeds.insert(move.speed_mm_s);
    }
  }
  return {speeds.begin(), speeds.end()};
}

/// Slow is dark, fast is light; the lightest end of the map would vanish on the plate.
Color SpeedColor(const std::vector<double>& speeds, double speed_mm_s) {
  const auto at = std::lower_bound(speeds.begin(), speeds.end(), speed_mm_s) - speeds.begin();
  const double last = std::max<double>(1, static_cast<double>(speeds.size()) - 1);
  return MapColor(0.12 + 0.68 * static_cast<double>(at) / last);
}

void DrawMoves(Canvas& canvas, const Plot& plot, const pa::PatternLayout& layout, double least_px) {
  const std::vector<double> speeds = Speeds(layout);
  const double scale = plot.X(1) - plot.X(0);
  canvas.Clip(plot.inner());
  for (const bool beads : {false, true}) {  // travels lie below
    for (const pa::Move& move : layout.moves) {
      const PointPx path[] = {plot.At({move.from.x_mm, move.from.y_mm}),
                              plot.At({move.to.x_mm, move.to.y_mm})};
      if (beads && Extrudes(move)) {
        canvas.Polyline(path, {.color = SpeedColor(speeds, move.speed_mm_s),
                               .width_px = std::max(least_px, move.width_mm * scale),
                               .round_ends = true});
      } else if (!beads && move.kind == pa::MoveKind::kTravel) {
        canvas.Polyline(path, {.color = kTravel, .width_px = 0.8, .dash_px = {3, 3}});
      }
    }
  }
  canvas.Unclip();
}

void DrawBed(Canvas& canvas, const RectPx& room, const pa::PatternLayout& layout,
             const pa::PatternConfig& config) {
  DrawMoves(canvas, BedPlot(canvas, room, config), layout, 0.6);
}

/// A dimension line from a to b with end strokes and its text at the middle.
void DrawDimension(Canvas& canvas, const PointPx& a, const PointPx& b, const std::string& text) {
  constexpr double kEndPx = 4;
  const bool level = std::abs(b.x - a.x) > std::abs(b.y - a.y);
  const Stroke stroke{.color = kMuted, .width_px = 1};
  const PointPx line[] = {a, b};
  canvas.Polyline(line, stroke);
  for (const PointPx& end : {a, b}) {
    const PointPx bar[] = {{end.x - (level ? 0 : kEndPx), end.y - (level ? kEndPx : 0)},
                           {end.x + (level ? 0 : kEndPx), end.y + (level ? kEndPx : 0)}};
    canvas.Polyline(bar, stroke);
  }
  const PointPx middle{(a.x + b.x) / 2, (a.y + b.y) / 2};
  canvas.Text(level ? PointPx{middle.x, middle.y - 5} : PointPx{middle.x - 6, middle.y}, text,
              {.size_px = kTickTextPx,
               .color = kMuted,
               .align = Align::kMiddle,
               .angle_rad = level ? 0 : -std::numbers::pi / 2});
}

void DrawLineLabels(Canvas& canvas, const Plot& plot, const pa::PatternLayout& layout,
                    double right_px) {
  std::vector<std::pair<double, double>> labels;  // height on the canvas, pressure advance
  for (const pa::PatternLine& line : layout.lines) {
    if (line.pattern == 0) {
      labels.emplace_back(plot.Y((line.start.y_mm + line.end.y_mm) / 2), line.pressure_advance_s);
      canvas.Circle(plot.At({line.start.x_mm, line.start.y_mm}), 3, kPaper,
                    Stroke{.color = kInk, .width_px = 1.2});
    }
  }
  std::sort(labels.begin(), labels.end());
  double last = -kTextPitchPx;
  for (const auto& [y, pressure_advance_s] : labels) {
    if (y - last >= kTextPitchPx) {
      canvas.Text({right_px, y + 4}, fmt::format("{:.4f}", pressure_advance_s), {});
      last = y;
    }
  }
}

void DrawCloseUp(Canvas& canvas, const RectPx& room, const pa::PatternLayout& layout,
                 const pa::PatternConfig& config) {
  const pa::BoundsMm& bounds = layout.patterns.front();
  const double margin =
      0.03 * std::max(bounds.max_x_mm - bounds.min_x_mm, bounds.max_y_mm - bounds.min_y_mm);
  const Plot plot = EvenPlot(
      canvas, room, {"x (mm)", {bounds.min_x_mm - margin, bounds.max_x_mm + margin}, 6},
      {"y (mm)", {bounds.min_y_mm - margin, bounds.max_y_mm + margin}, 6},
      layout.patterns.size() > 1 ? fmt::format("The first of {} patterns", layout.patterns.size())
                                 : "The pattern");
  canvas.FillRect(plot.inner(), kPlate);
  DrawMoves(canvas, plot, layout, 0.8);
  const RectPx& inner = plot.inner();
  canvas.Text({inner.right() + 8, inner.y - 8}, "PA (s)",
              {.size_px = kLabelTextPx, .color = kMuted});
  DrawLineLabels(canvas, plot, layout, inner.right() + 8);
  const double below = inner.bottom() + 58;
  DrawDimension(canvas, {plot.X(bounds.min_x_mm), below}, {plot.X(bounds.max_x_mm), below},
                fmt::format("{:.2f} mm (lines {:.4g} mm)", bounds.max_x_mm - bounds.min_x_mm,
                            config.line_length_mm));
  const double beside = inner.right() + 78;
  DrawDimension(canvas, {beside, plot.Y(bounds.min_y_mm)}, {beside, plot.Y(bounds.max_y_mm)},
                fmt::format("{:.2f} mm (pitch {:.4g} mm)", bounds.max_y_mm - bounds.min_y_mm,
                            config.line_spacing_mm));
}

void DrawSpeedLegend(Canvas& canvas, const PointPx& at, double width_px,
                     const pa::PatternLayout& layout) {
  std::vector<LegendEntry> entries;
  const std::vector<double> speeds = Speeds(layout);
  for (const double speed : speeds) {
    entries.push_back({fmt::format("{:.4g} mm/s", speed),
                       LegendEntry::Mark::kPatch,
                       {.color = SpeedColor(speeds, speed)}});
  }
  entries.push_back(
      {"travel", LegendEntry::Mark::kLine, {.color = kTravel, .width_px = 1.2, .dash_px = {3, 3}}});
  entries.push_back({"start of a line", LegendEntry::Mark::kHollowDot, {.color = kInk}});
  DrawLegend(canvas, at, width_px, entries);
}

}  // namespace

Canvas PatternPreview(const pa::PatternLayout& layout, const pa::PatternConfig& config) {
  TRAMMEL_CHECK(!layout.lines.empty() && !layout.patterns.empty(), "{} lines, {} patterns",
                layout.lines.size(), layout.patterns.size());
  Canvas canvas(kWidthPx, kHeightPx);
  DrawBed(canvas, {60, 40, 400, 500}, layout, config);
  DrawCloseUp(canvas, {540, 40, 450, 480}, layout, config);
  if (!settings::FindTemperatureProblem(config)) {
    canvas.Text({24, kHeightPx - 52},
                "Heated to " + SpelledOut(settings::DescribeTemperatures(config)),
                {.size_px = kLabelTextPx});
  }
  DrawSpeedLegend(canvas, {24, kHeightPx - 24}, kWidthPx - 48, layout);
  return canvas;
}

}  // namespace trammel::report
