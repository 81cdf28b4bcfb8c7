// The page as it was scanned, with what was found on it.
#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <numbers>

#include "document/interval_text.h"
#include "document/plot.h"
#include "tool_offset/report/offset_figures.h"
#include "tool_offset/sheet/sheet_layout.h"

namespace trammel::report {
namespace {

namespace to = tool_offset;

/// Position of the whole page on a canvas, upright as scanned.
struct PageWindow {
  RectPx to;      ///< on the canvas
  double px = 1;  ///< of the page, per px of the canvas

  [[nodiscard]] PointPx At(to::PagePoint point) const {
    return {to.x + (point.x_px + 0.5) / px, to.y + (point.y_px + 0.5) / px};
  }
};

/// Draws the page's pixels: means over what one pixel of the picture covers.
void DrawPage(Canvas& canvas, const PageView& page, const PageWindow& window) {
  constexpr double kDensity = 1.25;  // what a canvas keeps of a picture, px per px
  constexpr int kMaxSamples = 4;     // along each side of a pixel of the picture
  const double density = std::clamp(window.px, 0.5, kDensity);
  Frame picture(std::max(1, static_cast<int>(std::lround(window.to.width * density))),
                std::max(1, static_cast<int>(std::lround(window.to.height * density))));
  const double covered = window.px / density;
  const int samples = std::clamp(static_cast<int>(std::lround(covered)), 1, kMaxSamples);
  const auto sampled = [&](int pixel, int sample, int size) {
    return std::min(static_cast<int>((pixel + (sample + 0.5) / samples) * covered), size - 1);
  };
  for (int y = 0; y < picture.height; ++y) {
    std::uint8_t* out = picture.row(y);
    for (int x = 0; x < picture.width; ++x) {
      for (int c = 0; c < 3; ++c) {
        int sum = 0;
        for (int i = 0; i < samples * samples; ++i) {
          const std::uint8_t* row = page.row(sampled(y, i / samples, page.height));
          sum += row[sampled(x, i % samples, page.width) * page.channels +
                     (page.channels == 3 ? c : 0)];
        }
        *out++ = static_cast<std::uint8_t>(sum / (samples * samples));
      }
    }
  }
  canvas.Image(picture.view(), window.to, Pixels::kPhoto);
}

/// Draws a line visible on ink and on paper alike.
void HaloLine(Canvas& canvas, std::span<const PointPx> points, const Stroke& stroke) {
  constexpr double kHaloPx = 1;
  Stroke halo = stroke;
  halo.color = WithAlpha(kPaper, 0.85);
  halo.width_px += 2 * kHaloPx;
  halo.dash_px.clear();
  canvas.Polyline(points, halo);
  canvas.Polyline(points, stroke);
}

/// Draws text on a patch of paper; its angle counts, its alignment is the middle.
void TagText(Canvas& canvas, const PointPx& middle, std::string_view text, const TextStyle& style) {
  constexpr double kRoomPx = 2.5;
  constexpr double kBelow = 0.36;  // of the size: from the letters' middle to the baseline
  const double half = canvas.TextWidth(text, style) / 2 + kRoomPx;
  const double tall = style.size_px * 0.55 + 1;
  const double c = std::cos(style.angle_rad);
  const double s = std::sin(style.angle_rad);
  const auto at = [&](double along, double below) {
    return PointPx{middle.x + along * c - below * s, middle.y + along * s + below * c};
  };
  const PointPx patch[] = {at(-half, -tall), at(half, -tall), at(half, tall), at(-half, tall)};
  canvas.Polygon(patch, WithAlpha(kPaper, 0.88));
  TextStyle centred = style;
  centred.align = Align::kMiddle;
  canvas.Text(at(0, kBelow * style.size_px), text, centred);
}

/// Draws a small x.
void Cross(Canvas& canvas, const PointPx& middle, double half_px, const Stroke& stroke) {
  const PointPx down[] = {{middle.x - half_px, middle.y - half_px},
                          {middle.x + half_px, middle.y + half_px}};
  const PointPx up[] = {{middle.x - half_px, middle.y + half_px},
                        {middle.x + half_px, middle.y - half_px}};
  HaloLine(canvas, down, stroke);
  HaloLine(canvas, up, stroke);
}

constexpr double kTallestPx = 1080;

/// Returns the letter size of names on the page: smaller on a phone, as are structures.
double TagPx(const Canvas& canvas) { return canvas.width_px() < kFigureWidthPx ? 7.5 : 10.5; }

/// Returns a figure on the sheet, bent like the paper, as a closed path on the canvas.
std::vector<PointPx> Outline(const PageWindow& window, const to::PageMap& map,
                             to::SheetPoint middle, double half_u_mm, double half_v_mm) {
  constexpr int kSteps = 12;
  const to::SheetPoint corners[] = {{middle.u_mm - half_u_mm, middle.v_mm - half_v_mm},
                                    {middle.u_mm + half_u_mm, middle.v_mm - half_v_mm},
                                    {middle.u_mm + half_u_mm, middle.v_mm + half_v_mm},
                                    {middle.u_mm - half_u_mm, middle.v_mm + half_v_mm},
                                    {middle.u_mm - half_u_mm, middle.v_mm - half_v_mm}};
  std::vector<PointPx> path;
  for (std::size_t side = 0; side < 4; ++side) {
    for (int i = 0; i <= kSteps; ++i) {
      const double part = static_cast<double>(i) / kSteps;
      const to::SheetPoint& a = corners[side];
      const to::SheetPoint& b = corners[side + 1];
      path.push_back(window.At(
          map.ToPage({a.u_mm + part * (b.u_mm - a.u_mm), a.v_mm + part * (b.v_mm - a.v_mm)})));
    }
  }
  return path;
}

/// Returns the angle of text along a line that runs to the right or up.
double ReadableAngle(const PointPx& from, const PointPx& to) {
  constexpr double kHalfTurn = std::numbers::pi;
  double angle = std::atan2(to.y - from.y, to.x - from.x);
  if (angle > kHalfTurn / 2 - 0.01) angle -= kHalfTurn;
  if (angle < -kHalfTurn / 2 - 0.01) angle += kHalfTurn;
  return angle;
}

void DrawBox(Canvas& canvas, const PageWindow& window, const to::SheetPlan& plan,
             const to::SheetOnPage& sheet) {
  constexpr std::size_t kMaxPlaces = 300;
  HaloLine(canvas, Outline(window, sheet.map, {}, plan.width_mm / 2, plan.height_mm / 2),
           {.color = kBlue, .width_px = 1.4});
  const std::size_t step = std::max<std::size_t>(1, sheet.box_places.size() / kMaxPlaces);
  for (std::size_t i = 0; i < sheet.box_places.size(); i += step) {
    canvas.Circle(window.At(sheet.box_places[i].place), 1.3, kVermilion);
  }
  for (const to::PagePoint& corner : sheet.corners) {
    canvas.Circle(window.At(corner), 7, std::nullopt, Stroke{.color = kPaper, .width_px = 4});
    canvas.Circle(window.At(corner), 7, std::nullopt, Stroke{.color = kVermilion, .width_px = 2});
  }
}

/// Draws the axes from the box's lower left corner, along its sides.
void DrawAxes(Canvas& canvas, const PageWindow& window, const to::SheetPlan& plan,
              const to::PageMap& map) {
  constexpr double kLength_mm = 28;
  constexpr double kHeadPx = 9;
  const to::SheetPoint corner{-plan.width_mm / 2, -plan.height_mm / 2};
  const PointPx from = window.At(map.ToPage(corner));
  for (const bool is_u : {true, false}) {
    const PointPx tip = window.At(
        map.ToPage({corner.u_mm + (is_u ? kLength_mm : 0), corner.v_mm + (is_u ? 0 : kLength_mm)}));
    const double length = std::hypot(tip.x - from.x, tip.y - from.y);
    if (!(length > 0)) continue;
    const double x = (tip.x - from.x) / length * kHeadPx;
    const double y = (tip.y - from.y) / length * kHeadPx;
    const PointPx line[] = {from, tip};
    HaloLine(canvas, line, {.color = kInk, .width_px = 3});
    const PointPx head[] = {{tip.x + x, tip.y + y},
                            {tip.x - y * 0.6, tip.y + x * 0.6},
                            {tip.x + y * 0.6, tip.y - x * 0.6}};
    canvas.Polygon(head, kInk, Stroke{.color = kPaper, .width_px = 1});
    TagText(canvas, {tip.x + 2.2 * x, tip.y + 2.2 * y}, is_u ? "u" : "v",
            {.size_px = 14, .bold = true});
  }
}

void DrawStructures(Canvas& canvas, const PageWindow& window, const to::SheetPlan& plan,
                    const to::SheetResult& result) {
  const double half_long = to::StructureLength_mm(plan.settings) / 2;
  const double half_wide = to::StructureThickness_mm(plan.settings) / 2;
  const to::PageMap& map = result.sheet.map;
  for (const to::StructureReading& reading : result.structures) {
    const to::Structure& structure = plan.structures[reading.structure];
    const bool is_x = structure.axis == to::Axis::kX;
    const bool good = reading.offset_mm.good();
    HaloLine(canvas,
             Outline(window, map, structure.middle, is_x ? half_long : half_wide,
                     is_x ? half_wide : half_long),
             {.color = good ? kBlue : kVermilion,
              .width_px = good ? 1.0 : 2.2,
              .dash_px = good ? std::vector<double>{} : std::vector<double>{6, 4}});
    for (const to::FingerReading& finger : reading.fingers) {
      const bool planned = finger.finger == structure.incomplete[finger.comb];
      if (finger.left_out.empty() || planned) continue;
      Cross(canvas, window.At(finger.place), 4, {.color = kInk, .width_px = 1.6});
    }
    const PointPx from = window.At(map.ToPage(structure.middle));
    const PointPx to = window.At(map.ToPage({structure.middle.u_mm + (is_x ? half_long : 0),
                                             structure.middle.v_mm + (is_x ? 0 : half_long)}));
    TagText(canvas, from,
            reading.name + (good ? "" : ": " + VerdictText(reading.offset_mm.verdict())),
            {.size_px = TagPx(canvas), .bold = true, .angle_rad = ReadableAngle(from, to)});
  }
}

void DrawCodeRow(Canvas& canvas, const PageWindow& window, const to::SheetPlan& plan,
                 const to::SheetOnPage& sheet) {
  if (plan.code.empty()) return;
  const to::SheetPoint& first = plan.code.front().middle;
  const to::SheetPoint& last = plan.code.back().middle;
  const to::SheetPoint middle{(first.u_mm + last.u_mm) / 2, (first.v_mm + last.v_mm) / 2};
  const double half_mm = (last.u_mm - first.u_mm) / 2 + to::kCodeCell_mm / 2;
  HaloLine(canvas, Outline(window, sheet.map, middle, half_mm, to::kCodeLeg_mm / 2 + 0.6),
           {.color = kBlue, .width_px = 1.4});
  const PointPx from = window.At(sheet.map.ToPage(middle));
  const PointPx to = window.At(sheet.map.ToPage(last));
  TagText(canvas, from, fmt::format("code: sheet {}", plan.sheet_id),
          {.size_px = TagPx(canvas), .bold = true, .angle_rad = ReadableAngle(from, to)});
}

Canvas Draw(const PageView& page, const to::SheetPlan& plan, const to::SheetResult& result,
            double width_px) {
  using Mark = LegendEntry::Mark;
  const LegendEntry legend[] = {
      {plan.code.empty() ? "box, structure: as fitted" : "box, structure, code: as fitted",
       Mark::kLine,
       {.color = kBlue}},
      {"refused, or not found",
       Mark::kLine,
       {.color = kVermilion, .width_px = 2, .dash_px = {6, 4}}},
      {"where the box's line was found", Mark::kDot, {.color = kVermilion}},
      {"corner as first seen", Mark::kHollowDot, {.color = kVermilion}},
  };
  const double px = std::max(page.width / width_px, page.height / kTallestPx);
  const PageWindow window{{0, 0, page.width / px, page.height / px}, px};
  Canvas canvas(width_px, window.to.height + (width_px < kFigureWidthPx ? 90 : 70));
  DrawPage(canvas, page, window);
  canvas.Clip(window.to);
  DrawStructures(canvas, window, plan, result);
  DrawCodeRow(canvas, window, plan, result.sheet);
  DrawBox(canvas, window, plan, result.sheet);
  DrawAxes(canvas, window, plan, result.sheet.map);
  canvas.Unclip();
  DrawLegend(canvas, {8, window.to.bottom() + 22}, width_px - 16, legend);
  return canvas;
}

Figure PageFigure(const PageView& page, const to::SheetPlan& plan, const to::SheetResult& result) {
  constexpr double kDegrees = 180 / std::numbers::pi;
  const char* seen = result.photo ? "photo" : "scan";
  std::string text = fmt::format(
      "The {} as it is, reduced. u and v are the sheet's axes; u is turned by {:.2f}° "
      "counter-clockwise from the {}'s rows. The box's lines lie within {:.1f} µm (rms) of the map "
      "that everything else is found with. Each name must lie on the structure of that name; a "
      "black × is a tooth that was left out.",
      seen, result.sheet.angle_rad * kDegrees, seen, result.sheet.box_rms_mm * kUmPerMm);
  return Figure{"page",
                std::move(text),
                Draw(page, plan, result, kFigureWidthPx),
                2,
                fmt::format("The {} of the sheet with its box{} and {} structures outlined, turned "
                            "by {:.1f}°.",
                            seen, plan.code.empty() ? "" : ", its code", result.structures.size(),
                            result.sheet.angle_rad * kDegrees),
                Draw(page, plan, result, kNarrowWidthPx)};
}

}  // namespace

DrawnFigure DrawnPage(const PageView& page, const to::SheetPlan& plan,
                      const to::SheetResult& result) {
  const Figure figure = PageFigure(page, plan, result);
  DrawnFigure drawn = Drawn(figure);
  for (std::size_t step = 0; step < kPhotoSteps.size(); ++step) {
    drawn.html[step] = FigureHtml(figure, kPhotoSteps[step]);
  }
  return drawn;
}

}  // namespace trammel::report
