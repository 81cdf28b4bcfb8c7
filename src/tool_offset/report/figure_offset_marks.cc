// The code and the coarse marks, as they were read.
#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "document/plot.h"
#include "tool_offset/report/offset_figures.h"
#include "tool_offset/report/offset_style.h"
#include "tool_offset/report/sheet_picture.h"
#include "tool_offset/sheet/sheet_layout.h"

namespace trammel::report {
namespace {

namespace to = tool_offset;

constexpr double kSidePx = 8;

/// One bar per cell, from 0 to its ink.
void DrawInk(Canvas& canvas, const RectPx& room, const std::vector<double>& x, double width,
             const to::CodeReading& code) {
  constexpr double kMost = 1.3;  // ink of a dark cell is about 1
  const double zero = room.bottom();
  for (std::size_t i = 0; i < std::min(x.size(), code.ink.size()); ++i) {
    if (!std::isfinite(code.ink[i])) continue;
    const double height = room.height * std::clamp(code.ink[i], 0.0, kMost) / kMost;
    canvas.FillRect({x[i] - width / 2, zero - height, width, height},
                    i < code.dark.size() && code.dark[i] ? kInk : kSky);
  }
  const PointPx line[] = {{room.x, zero}, {room.right(), zero}};
  canvas.Polyline(line, {.color = kMuted, .width_px = 1});
}

/// All four legs as planned, or as found.
void DrawMarkLegs(Canvas& canvas, const PageWindow& window, const to::SheetPlan& plan,
                  const to::PageMap& map, const to::CoarseMark& mark, to::SheetPoint shift,
                  const Stroke& stroke) {
  for (const to::Leg& leg : to::CoarseLegs(plan, mark)) {
    const auto at = [&](const to::SheetPoint& point) {
      return window.At(map.ToPage({point.u_mm + shift.u_mm, point.v_mm + shift.v_mm}));
    };
    const PointPx line[] = {at(leg.start), at(leg.end)};
    canvas.Polyline(line, stroke);
  }
}

std::string MarkWords(const to::ToolReading& tool) {
  if (!tool.coarse_reading.found) return fmt::format("T{}: no mark found", tool.tool);
  return fmt::format("T{}: dx {:+.2f}, dy {:+.2f} mm", tool.tool, tool.coarse_mm.u_mm,
                     tool.coarse_mm.v_mm);
}

Canvas DrawCode(const PageView& page, const to::SheetPlan& plan, const to::SheetResult& result,
                double width_px) {
  constexpr double kPicturePx = 76;
  constexpr double kInkPx = 46;
  const to::CodeReading& code = result.sheet.code;
  Canvas canvas(width_px, 172);
  const double middle_u = (plan.code.front().middle.u_mm + plan.code.back().middle.u_mm) / 2;
  const double width_mm =
      plan.code.back().middle.u_mm - plan.code.front().middle.u_mm + 2 * to::kCodeCell_mm;
  const PageWindow window =
      AroundPlace(result.sheet.map, {middle_u, plan.code.front().middle.v_mm}, width_mm,
                  {kSidePx, 26, width_px - 2 * kSidePx, kPicturePx});
  const double cell_px = window.to.width / width_mm * to::kCodeCell_mm;
  DrawPage(canvas, page, window);
  std::vector<double> x;
  for (std::size_t i = 0; i < plan.code.size(); ++i) {
    const PointPx middle = window.At(result.sheet.map.ToPage(plan.code[i].middle));
    x.push_back(middle.x);
    canvas.StrokeRect({middle.x - cell_px / 2 + 1, window.to.y + 8, cell_px - 2, kPicturePx - 16},
                      {.color = kBlue, .width_px = 1.2});
    const bool dark = i < code.dark.size() && code.dark[i];
    const bool wrong = dark != plan.code[i].dark;
    canvas.Text({middle.x, 18}, fmt::format("{}{}", dark ? 1 : 0, wrong ? "!" : ""),
                {.color = wrong ? kVermilion : kInk, .align = Align::kMiddle, .bold = wrong});
  }
  DrawInk(canvas, {window.to.x, window.to.bottom() + 8, window.to.width, kInkPx}, x, cell_px * 0.5,
          code);
  return canvas;
}

std::size_t MarksOf(const to::SheetPlan& plan, const to::SheetResult& result) {
  return std::min(plan.coarse_marks.size(), result.tools.size());
}

Canvas DrawMarks(const PageView& page, const to::SheetPlan& plan, const to::SheetResult& result,
                 double width_px) {
  constexpr double kShown_mm = 14;
  const bool broad = width_px >= kFigureWidthPx;
  const std::size_t columns = broad ? 4 : 2;
  const double panel_px = broad ? 180 : 156;
  const double cell_px = width_px / static_cast<double>(columns);
  const double row_px = panel_px + 30;
  const std::size_t count = MarksOf(plan, result);
  const std::size_t rows = (count + columns - 1) / columns;
  Canvas canvas(width_px, static_cast<double>(rows) * row_px + 26);
  using Mark = LegendEntry::Mark;
  const LegendEntry legend[] = {
      {"planned", Mark::kLine, {.color = kBlue, .width_px = 1.5, .dash_px = {4, 3}}},
      {"found", Mark::kLine, {.color = kVermilion, .width_px = 1.8}}};
  DrawLegend(canvas, {kSidePx, 16}, width_px, legend);
  for (std::size_t i = 0; i < count; ++i) {
    const to::CoarseMark& mark = plan.coarse_marks[i];
    const to::ToolReading& tool = result.tools[i];
    const RectPx panel{static_cast<double>(i % columns) * cell_px + (cell_px - panel_px) / 2,
                       static_cast<double>(i / columns) * row_px + 26, panel_px, panel_px};
    // Legs lie to the right of and above where their middle lines cross.
    const double beside_mm = (to::kCoarseLeg_mm + to::kCoarseLegStart_mm) / 2;
    const PageWindow window =
        AroundPlace(result.sheet.map, {mark.middle.u_mm + beside_mm, mark.middle.v_mm + beside_mm},
                    kShown_mm, panel);
    DrawPage(canvas, page, window);
    canvas.Clip(panel);
    DrawMarkLegs(canvas, window, plan, result.sheet.map, mark, {},
                 {.color = kBlue, .width_px = 1.5, .dash_px = {4, 3}});
    if (tool.coarse_reading.found) {
      DrawMarkLegs(canvas, window, plan, result.sheet.map, mark, tool.coarse_reading.shift,
                   {.color = kVermilion, .width_px = 1.5});
    }
    canvas.Unclip();
    canvas.Text({panel.x + panel.width / 2, panel.bottom() + 16}, MarkWords(tool),
                {.size_px = broad ? 12.0 : 10.5,
                 .color = tool.coarse_reading.found ? kInk : kVermilion,
                 .align = Align::kMiddle,
                 .bold = !tool.coarse_reading.found});
  }
  return canvas;
}

}  // namespace

Figure CodeFigure(const PageView& page, const to::SheetPlan& plan, const to::SheetResult& result) {
  if (plan.code.empty()) return {"code", "This sheet has no code.", Canvas(kFigureWidthPx, 1)};
  const to::CodeReading& code = result.sheet.code;
  return Figure{
      "code",
      fmt::format(
          "The code: above each cell what was read in it (1 is a line), with an "
          "exclamation mark where the plan says otherwise; below it how much ink it holds. "
          "{} of {} cells differ from sheet {}; dark and light cells are {:.2f} apart (1 is "
          "the full ink of a line, 0.3 is needed).",
          code.wrong_cells, plan.code.size(), plan.sheet_id, code.contrast),
      DrawCode(page, plan, result, kFigureWidthPx),
      2,
      fmt::format("The row of {} code cells, {} of them read otherwise than planned.",
                  plan.code.size(), code.wrong_cells),
      DrawCode(page, plan, result, kNarrowWidthPx)};
}

std::optional<Figure> MarksFigure(const PageView& page, const to::SheetPlan& plan,
                                  const to::SheetResult& result) {
  if (MarksOf(plan, result) == 0) return std::nullopt;
  return Figure{
      "marks",
      "The coarse mark of each tested tool, u to the right and v up. The orange lines must "
      "lie on the tool's ink; where they lie beside the blue ones, the tool is off by "
      "that much. dx and dy are along the bed's axes, from the reference tool.",
      DrawMarks(page, plan, result, kFigureWidthPx),
      2,
      fmt::format("Coarse marks of {} tools on the scan, planned and found.", result.tools.size()),
      DrawMarks(page, plan, result, kNarrowWidthPx)};
}

}  // namespace trammel::report
