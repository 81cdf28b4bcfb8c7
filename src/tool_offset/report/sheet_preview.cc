#include "tool_offset/report/sheet_preview.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <functional>
#include <numbers>
#include <string>
#include <vector>

#include "base/check.h"
#include "document/plot.h"
#include "settings/printer.h"
#include "tool_offset/sheet/sheet_bed.h"
#include "tool_offset/sheet/sheet_layout.h"
#include "tool_offset/sheet/sheet_temperatures.h"

namespace trammel::report {
namespace {

constexpr Color kPlate = Rgb(0xf3f5f7);

void DrawPlate(Canvas& canvas, const RectPx& inner, settings::BedShape shape) {
  const Stroke edge{.color = kMuted, .width_px = 1.5};
  if (shape == settings::BedShape::kRectangle) {
    canvas.FillRect(inner, kPlate);
    canvas.StrokeRect(inner, edge);
    return;
  }
  constexpr int kCorners = 120;
  std::vector<PointPx> outline;
  for (int i = 0; i < kCorners; ++i) {
    const double angle = 2 * std::numbers::pi * i / kCorners;
    outline.push_back({inner.x + inner.width / 2 * (1 + std::cos(angle)),
                       inner.y + inner.height / 2 * (1 + std::sin(angle))});
  }
  canvas.Polygon(outline, kPlate, edge);
}

/// Makes a plot in the middle of `room`, the same scale on both axes.
Plot EvenPlot(Canvas& canvas, const RectPx& room, const Axis& x, const Axis& y,
              const std::string& title) {
  const double scale =
      std::min(room.width / (x.range.hi - x.range.lo), room.height / (y.range.hi - y.range.lo));
  const double width = (x.range.hi - x.range.lo) * scale;
  const double height = (y.range.hi - y.range.lo) * scale;
  const RectPx inner{room.x + (room.width - width) / 2, room.y, width, height};
  return Plot::Around(canvas, inner, x, y, title);
}

/// Draws the whole bed in its own coordinates, with its outline.
Plot BedPlot(Canvas& canvas, const RectPx& room, const settings::PrinterSettings& printer) {
  const Range x{printer.bed_origin_x_mm, printer.bed_origin_x_mm + printer.bed_size_x_mm};
  const Range y{printer.bed_origin_y_mm, printer.bed_origin_y_mm + printer.bed_size_y_mm};
  Plot plot =
      EvenPlot(canvas, room, {"x (mm)", x, 6}, {"y (mm)", y, 6},
               fmt::format("Bed {:.4g} × {:.4g} mm", printer.bed_size_x_mm, printer.bed_size_y_mm));
  DrawPlate(canvas, plot.inner(), printer.bed_shape);
  return plot;
}

namespace to = tool_offset;

constexpr double kWidthPx = 1200;
constexpr double kHeightPx = 760;

/// Returns the tool's colour: ink for the reference tool; the others differ in hue and lightness.
Color ToolColor(const to::SheetSettings& settings, int tool) {
  if (tool == settings.reference_tool) return kInk;
  constexpr std::array<Color, 7> kColors{kVermilion,    kBlue,         Rgb(0x1b8a6b), Rgb(0xb04a9a),
                                         Rgb(0xb98a00), Rgb(0x3fa0d8), Rgb(0x8a5a3c)};
  std::size_t tested = 0;
  for (const int other : settings.tools) {
    if (other == tool) break;
    if (other != settings.reference_tool) ++tested;
  }
  return kColors[tested % kColors.size()];
}

/// Visitor of drawn lines, with their tool.
using LegVisitor = std::function<void(int tool, const to::Leg& leg)>;

void VisitStructure(const to::SheetPlan& plan, const to::Structure& structure,
                    const LegVisitor& visit) {
  for (std::size_t comb = 0; comb < 2; ++comb) {
    for (int finger = 0; finger < plan.settings.teeth; ++finger) {
      for (const to::Leg& leg : to::FingerLegs(plan, structure, comb, finger)) {
        visit(structure.combs[comb].tool, leg);
      }
    }
  }
}

void VisitBox(const to::SheetPlan& plan, const LegVisitor& visit) {
  for (const double inset_mm : plan.box_insets_mm) {
    const double u_mm = plan.width_mm / 2 - inset_mm;
    const double v_mm = plan.height_mm / 2 - inset_mm;
    const std::array<to::SheetPoint, 4> corners{
        {{-u_mm, -v_mm}, {u_mm, -v_mm}, {u_mm, v_mm}, {-u_mm, v_mm}}};
    for (std::size_t i = 0; i < corners.size(); ++i) {
      visit(plan.settings.reference_tool, {corners[i], corners[(i + 1) % corners.size()]});
    }
  }
}

void VisitAll(const to::SheetPlan& plan, const LegVisitor& visit) {
  VisitBox(plan, visit);
  for (const to::Structure& structure : plan.structures) VisitStructure(plan, structure, visit);
  for (const to::PrimeLine& line : plan.prime_lines) visit(line.tool, line.leg);
}

void DrawLeg(Canvas& canvas, const to::SheetPlan& plan, int tool, const PointPx& from,
             const PointPx& to, double px_per_mm, double min_px) {
  const PointPx path[] = {from, to};
  canvas.Polyline(path, {.color = ToolColor(plan.settings, tool),
                         .width_px = std::max(min_px, plan.settings.line_width_mm * px_per_mm),
                         .round_ends = true});
}

/// Draws the paper at its required position; it may extend beyond the bed.
void DrawPaper(Canvas& canvas, const Plot& plot, const to::SheetPlan& plan) {
  const auto paper = to::PaperAround(plan);
  if (!paper) return;
  const PointPx low = plot.At({paper->bounds.min_x_mm, paper->bounds.min_y_mm});
  const PointPx high = plot.At({paper->bounds.max_x_mm, paper->bounds.max_y_mm});
  const PointPx outline[] = {low, {high.x, low.y}, high, {low.x, high.y}};
  canvas.Clip(plot.inner());
  canvas.Polygon(outline, kPaper, Stroke{.color = kInk, .width_px = 0.8});
  canvas.Text({std::max(low.x, plot.inner().x) + 4, std::max(high.y, plot.inner().y) + 12},
              paper->name + " paper", {.size_px = 10});
  canvas.Unclip();
}

void DrawOnBed(Canvas& canvas, const RectPx& room, const to::SheetPlan& plan) {
  const Plot plot = BedPlot(canvas, room, plan.settings.printer);
  DrawPaper(canvas, plot, plan);
  const double px_per_mm = plot.X(1) - plot.X(0);
  const auto at = [&](const to::SheetPoint& point) {
    const to::BedPoint on_bed = to::OnBed(plan, point);
    return plot.At({on_bed.x_mm, on_bed.y_mm});
  };
  VisitAll(plan, [&](int tool, const to::Leg& leg) {
    DrawLeg(canvas, plan, tool, at(leg.start), at(leg.end), px_per_mm, 0.4);
  });
}

void DrawNames(Canvas& canvas, const Plot& plot, const to::SheetPlan& plan) {
  for (const to::Structure& structure : plan.structures) {
    const PointPx at = plot.At({structure.middle.u_mm, structure.middle.v_mm});
    const bool across = structure.axis == to::Axis::kY;
    const TextStyle style{.size_px = 10,
                          .color = kInk,
                          .align = Align::kMiddle,
                          .bold = true,
                          .angle_rad = across ? -std::acos(0.0) : 0};
    const double width = canvas.TextWidth(structure.name, style) + 6;
    const double height = 13;
    canvas.FillRect({at.x - (across ? height : width) / 2, at.y - (across ? width : height) / 2,
                     across ? height : width, across ? width : height},
                    WithAlpha(kPaper, 0.85));
    canvas.Text(across ? PointPx{at.x + 3.5, at.y} : PointPx{at.x, at.y + 3.5}, structure.name,
                style);
  }
}

void DrawSheet(Canvas& canvas, const RectPx& room, const to::SheetPlan& plan) {
  constexpr double kMargin_mm = 3;
  double lowest_mm = -plan.height_mm / 2;
  for (const to::PrimeLine& line : plan.prime_lines) {
    lowest_mm = std::min(lowest_mm, line.leg.start.v_mm);
  }
  const Plot plot =
      EvenPlot(canvas, room,
               {"u (mm)", {-plan.width_mm / 2 - kMargin_mm, plan.width_mm / 2 + kMargin_mm}, 6},
               {"v (mm)", {lowest_mm - kMargin_mm, plan.height_mm / 2 + kMargin_mm}, 6},
               fmt::format("Sheet {}: {:.1f} × {:.1f} mm, turned by {:.4g}°", plan.sheet_id,
                           plan.width_mm, plan.height_mm, plan.settings.tilt_deg));
  canvas.FillRect(plot.inner(), kPlate);
  const double px_per_mm = plot.X(1) - plot.X(0);
  const auto at = [&](const to::SheetPoint& point) { return plot.At({point.u_mm, point.v_mm}); };
  VisitAll(plan, [&](int tool, const to::Leg& leg) {
    DrawLeg(canvas, plan, tool, at(leg.start), at(leg.end), px_per_mm, 0.4);
  });
  // Dark cells are filled, unlike the printed lines: a picture of the plan must never pass for a
  // scan of the sheet, whose tools would all be right.
  for (const to::CodeCell& cell : plan.code) {
    const PointPx low =
        at({cell.middle.u_mm - to::kCodeCell_mm / 2, cell.middle.v_mm + to::kCodeLeg_mm / 2});
    const RectPx rect{low.x, low.y, to::kCodeCell_mm * px_per_mm, to::kCodeLeg_mm * px_per_mm};
    if (cell.dark) canvas.FillRect(rect, ToolColor(plan.settings, plan.settings.reference_tool));
  }
  DrawNames(canvas, plot, plan);
}

}  // namespace

Canvas SheetPreview(const to::SheetPlan& plan) {
  TRAMMEL_CHECK(!plan.structures.empty(), "{} structures", plan.structures.size());
  Canvas canvas(kWidthPx, kHeightPx);
  DrawOnBed(canvas, {70, 40, 370, 370}, plan);
  DrawSheet(canvas, {540, 40, 620, 600}, plan);
  if (!to::FindTemperatureProblem(plan.settings)) {
    canvas.Text({24, kHeightPx - 52}, "Heated to " + to::DescribeTemperatures(plan.settings),
                {.size_px = kLabelTextPx});
  }
  std::vector<LegendEntry> entries;
  for (const int tool : plan.settings.tools) {
    entries.push_back(
        {fmt::format("T{}{}", tool, tool == plan.settings.reference_tool ? " (reference)" : ""),
         LegendEntry::Mark::kPatch,
         {.color = ToolColor(plan.settings, tool)}});
  }
  DrawLegend(canvas, {24, kHeightPx - 24}, kWidthPx - 48, entries);
  return canvas;
}

}  // namespace trammel::report
