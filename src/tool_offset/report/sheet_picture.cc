#include "tool_offset/report/sheet_picture.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <numbers>

#include "document/interval_text.h"
#include "document/plot.h"
#include "tool_offset/report/offset_figures.h"
#include "tool_offset/report/offset_table.h"
#include "tool_offset/sheet/sheet_layout.h"

namespace trammel::report {
namespace {

namespace to = tool_offset;

constexpr double kDensity = 1.25;  ///< what a canvas keeps of a picture, px per px
constexpr std::array<double, 3> kBeside{217, 220, 225};

/// Adds the page at a place, linearly between its pixels; false beside the page.
bool AddAt(const PageView& page, to::PagePoint at, std::array<double, 3>& sum) {
  if (!(at.x_px >= 0 && at.y_px >= 0 && at.x_px <= page.width - 1 && at.y_px <= page.height - 1)) {
    return false;
  }
  const int x0 = std::min(static_cast<int>(at.x_px), std::max(0, page.width - 2));
  const int y0 = std::min(static_cast<int>(at.y_px), std::max(0, page.height - 2));
  const int x1 = std::min(x0 + 1, page.width - 1);
  const int y1 = std::min(y0 + 1, page.height - 1);
  const double fx = at.x_px - x0;
  const double fy = at.y_px - y0;
  const int step = page.channels;
  for (int c = 0; c < 3; ++c) {
    const int channel = step == 3 ? c : 0;
    const auto value = [&](int x, int y) {
      return static_cast<double>(page.row(y)[std::ptrdiff_t{step} * x + channel]);
    };
    const double top = value(x0, y0) * (1 - fx) + value(x1, y0) * fx;
    const double bottom = value(x0, y1) * (1 - fx) + value(x1, y1) * fx;
    sum[static_cast<std::size_t>(c)] += top * (1 - fy) + bottom * fy;
  }
  return true;
}

PageWindow Around(const to::LocalMap& local, to::PagePoint right_px_mm, to::PagePoint down_px_mm,
                  double px_per_mm, const RectPx& rect) {
  PageWindow window;
  window.to = rect;
  window.right = (1 / px_per_mm) * right_px_mm;
  window.down = (1 / px_per_mm) * down_px_mm;
  window.origin = local.at - (rect.width / 2) * window.right - (rect.height / 2) * window.down;
  return window;
}

}  // namespace

PointPx PageWindow::At(to::PagePoint point) const {
  const to::PagePoint from = point - origin;
  const double area = right.x_px * down.y_px - right.y_px * down.x_px;
  if (area == 0) return {std::numeric_limits<double>::quiet_NaN(), 0};
  return {to.x + (from.x_px * down.y_px - from.y_px * down.x_px) / area,
          to.y + (right.x_px * from.y_px - right.y_px * from.x_px) / area};
}

PageWindow WholePage(const PageView& page, const RectPx& room) {
  const double px = std::max(page.width / room.width, page.height / room.height);
  PageWindow window;
  window.to = {room.x, room.y, page.width / px, page.height / px};
  window.origin = {-0.5, -0.5};
  window.right = {px, 0};
  window.down = {0, px};
  return window;
}

PageWindow AlongStructure(const to::PageMap& map, const to::Structure& structure, double from_mm,
                          double to_mm, const RectPx& to_rect) {
  const bool is_x = structure.axis == to::Axis::kX;
  const double along_mm = (from_mm + to_mm) / 2;
  const to::LocalMap local = map.Near({structure.middle.u_mm + (is_x ? along_mm : 0),
                                       structure.middle.v_mm + (is_x ? 0 : along_mm)});
  const double px_per_mm = to_rect.width / (to_mm - from_mm);
  // With v to the right, u runs down: turned, not mirrored.
  return is_x ? Around(local, local.u_px_mm, -1.0 * local.v_px_mm, px_per_mm, to_rect)
              : Around(local, local.v_px_mm, local.u_px_mm, px_per_mm, to_rect);
}

void DrawPage(Canvas& canvas, const PageView& page, const PageWindow& window) {
  constexpr int kMostSamples = 4;  // along each side of a pixel of the picture
  const double density =
      std::clamp(std::max(to::Length(window.right), to::Length(window.down)), 0.5, kDensity);
  Frame picture(std::max(1, static_cast<int>(std::lround(window.to.width * density))),
                std::max(1, static_cast<int>(std::lround(window.to.height * density))));
  const to::PagePoint right = (window.to.width / picture.width) * window.right;
  const to::PagePoint down = (window.to.height / picture.height) * window.down;
  const int samples =
      std::clamp(static_cast<int>(std::lround(std::max(to::Length(right), to::Length(down)))), 1,
                 kMostSamples);
  for (int y = 0; y < picture.height; ++y) {
    std::uint8_t* out = picture.row(y);
    for (int x = 0; x < picture.width; ++x) {
      std::array<double, 3> sum{};
      int inside = 0;
      for (int i = 0; i < samples * samples; ++i) {
        const double across = x + (i % samples + 0.5) / samples;
        const double below = y + (i / samples + 0.5) / samples;
        inside += AddAt(page, window.origin + across * right + below * down, sum) ? 1 : 0;
      }
      for (std::size_t c = 0; c < 3; ++c) {
        *out++ = inside > 0 ? static_cast<std::uint8_t>(std::lround(sum[c] / inside))
                            : static_cast<std::uint8_t>(kBeside[c]);
      }
    }
  }
  canvas.Image(picture.view(), window.to, Pixels::kPhoto);
}

namespace {

/// Comb 0 and comb 1, told apart by lightness, too.
constexpr Color kCombColors[] = {kBlue, kVermilion};

/// A line that can be seen on ink and on paper alike.
void HaloLine(Canvas& canvas, std::span<const PointPx> points, const Stroke& stroke) {
  constexpr double kHaloPx = 1;
  Stroke halo = stroke;
  halo.color = WithAlpha(kPaper, 0.85);
  halo.width_px += 2 * kHaloPx;
  halo.dash_px.clear();
  canvas.Polyline(points, halo);
  canvas.Polyline(points, stroke);
}

/// Text on a patch of paper; its angle counts, its alignment is the middle.
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

/// A small x.
void Cross(Canvas& canvas, const PointPx& middle, double half_px, const Stroke& stroke) {
  const PointPx down[] = {{middle.x - half_px, middle.y - half_px},
                          {middle.x + half_px, middle.y + half_px}};
  const PointPx up[] = {{middle.x - half_px, middle.y + half_px},
                        {middle.x + half_px, middle.y - half_px}};
  HaloLine(canvas, down, stroke);
  HaloLine(canvas, up, stroke);
}

/// "T1", "T1 after 2 pick-ups".
std::string CombName(const to::Comb& comb) {
  if (comb.pick_up == 0) return fmt::format("T{}", comb.tool);
  return fmt::format("T{} after {} pick-up{}", comb.tool, comb.pick_up,
                     comb.pick_up == 1 ? "" : "s");
}

constexpr double kTallestPx = 1080;

/// Letters of what is named on the page: on a phone structures are as small.
double TagPx(const Canvas& canvas) { return canvas.width_px() < kFigureWidthPx ? 7.5 : 10.5; }

/// A figure on the sheet, bent like the paper, as a closed path on the canvas.
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

/// Of text along a line that runs to the right or up.
double ReadableAngle(const PointPx& from, const PointPx& to) {
  constexpr double kHalfTurn = std::numbers::pi;
  double angle = std::atan2(to.y - from.y, to.x - from.x);
  if (angle > kHalfTurn / 2 - 0.01) angle -= kHalfTurn;
  if (angle < -kHalfTurn / 2 - 0.01) angle += kHalfTurn;
  return angle;
}

void DrawBox(Canvas& canvas, const PageWindow& window, const to::SheetPlan& plan,
             const to::SheetOnPage& sheet) {
  constexpr std::size_t kMostPlaces = 300;
  HaloLine(canvas, Outline(window, sheet.map, {}, plan.width_mm / 2, plan.height_mm / 2),
           {.color = kBlue, .width_px = 1.4});
  const std::size_t step = std::max<std::size_t>(1, sheet.box_places.size() / kMostPlaces);
  for (std::size_t i = 0; i < sheet.box_places.size(); i += step) {
    canvas.Circle(window.At(sheet.box_places[i].place), 1.3, kVermilion);
  }
  for (const to::PagePoint& corner : sheet.corners) {
    canvas.Circle(window.At(corner), 7, std::nullopt, Stroke{.color = kPaper, .width_px = 4});
    canvas.Circle(window.At(corner), 7, std::nullopt, Stroke{.color = kVermilion, .width_px = 2});
  }
}

/// From the box's lower left corner, along its sides.
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
            reading.name + (good ? "" : ": " + VerdictWords(reading.offset_mm.verdict())),
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
  const PageWindow window = WholePage(page, {0, 0, width_px, kTallestPx});
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

}  // namespace

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

namespace {

constexpr double kSidePx = 8;
constexpr double kRowGapPx = 10;
constexpr double kPlotPx = 190;
constexpr double kPlotLeftPx = 70;  // the same for all, so that teeth stand above each other
constexpr double kPlotTopPx = 26;   // for the title
constexpr double kPlotGapPx = 14;   // to what comes below

/// What all parts of the figure need.
struct Shown {
  const PageView& page;
  const to::SheetPlan& plan;
  const to::PageMap& map;
  const to::Structure& structure;
  const to::StructureReading& reading;
  bool is_x = true;
  double half_mm = 0;   ///< of what is shown along the measured axis
  double outer_mm = 0;  ///< from the middle line to the far end of a leg
  double inner_mm = 0;  ///< and to the end that reaches into the other comb
  bool broad = true;    ///< not for a phone
};

std::string SlugOf(const std::string& name) {
  std::string slug = "structure-";
  for (const char c : name) {
    if (c >= 'A' && c <= 'Z') slug += static_cast<char>(c - 'A' + 'a');
    if ((c >= 'a' && c <= 'z') || (c >= '0' && c <= '9')) slug += c;
    if (c == '+') slug += "-plus";
    if (c == '-') slug += "-minus";
    if (c == ' ') slug += '-';
  }
  return slug;
}

to::PagePoint LegPlace(const Shown& shown, const to::LocalMap& local,
                       const to::FingerReading& finger, std::size_t leg, double along_leg_mm) {
  const double mean_mm = (finger.legs[0].position_mm + finger.legs[1].position_mm) / 2;
  const double beside_mm =
      finger.legs[leg].position_mm - mean_mm + finger.legs[leg].slope * along_leg_mm;
  const to::PagePoint& axis_px = shown.is_x ? local.u_px_mm : local.v_px_mm;
  const to::PagePoint& leg_px = shown.is_x ? local.v_px_mm : local.u_px_mm;
  return finger.place + beside_mm * axis_px + along_leg_mm * leg_px;
}

/// From where to where a comb's legs run, from the structure's middle line.
std::array<double, 2> LegEnds_mm(const Shown& shown, std::size_t comb) {
  const to::SheetPoint& shift = shown.reading.shift_mm[comb];
  const to::SheetPoint& programmed = shown.structure.combs[comb].programmed;
  const double across_mm = shown.is_x ? shift.v_mm + programmed.v_mm : shift.u_mm + programmed.u_mm;
  if (shown.structure.FromLowSide(comb))
    return {-shown.outer_mm + across_mm, shown.inner_mm + across_mm};
  return {-shown.inner_mm + across_mm, shown.outer_mm + across_mm};
}

void DrawFinger(Canvas& canvas, const Shown& shown, const PageWindow& window,
                const to::LocalMap& local, const to::FingerReading& finger) {
  const bool used = finger.left_out.empty();
  const std::array<double, 2> ends_mm = LegEnds_mm(shown, finger.comb);
  const Color& color = kCombColors[finger.comb];
  for (std::size_t leg = 0; leg < 2; ++leg) {
    if (finger.legs[leg].rows_used == 0) continue;
    const PointPx line[] = {window.At(LegPlace(shown, local, finger, leg, ends_mm[0])),
                            window.At(LegPlace(shown, local, finger, leg, ends_mm[1]))};
    HaloLine(canvas, line,
             {.color = color,
              .width_px = 1.3,
              .dash_px = used ? std::vector<double>{} : std::vector<double>{3, 3}});
  }
  const double outside_mm =
      shown.structure.FromLowSide(finger.comb) ? ends_mm[0] - 0.6 : ends_mm[1] + 0.6;
  const to::PagePoint& leg_px = shown.is_x ? local.v_px_mm : local.u_px_mm;
  const PointPx label = window.At(finger.place + outside_mm * leg_px);
  TagText(canvas, label, fmt::format("{}{}", used ? "" : "× ", finger.finger),
          {.size_px = 10.5, .color = used ? color : kInk, .bold = !used});
}

/// The structure in pieces, each a row; returns where the rows end.
double DrawRows(Canvas& canvas, const Shown& shown, int rows, double row_px, double top) {
  constexpr double kFinger_mm = 2;  // more than half of what is drawn of one
  for (int row = 0; row < rows; ++row) {
    const double from_mm = -shown.half_mm + 2 * shown.half_mm * row / rows;
    const double to_mm = from_mm + 2 * shown.half_mm / rows;
    const RectPx rect{kSidePx, top + row * (row_px + kRowGapPx), canvas.width_px() - 2 * kSidePx,
                      row_px};
    const PageWindow window = AlongStructure(shown.map, shown.structure, from_mm, to_mm, rect);
    DrawPage(canvas, shown.page, window);
    canvas.Clip(rect);
    for (const to::FingerReading& finger : shown.reading.fingers) {
      if (finger.place.x_px == 0 && finger.place.y_px == 0) continue;  // beside the page
      const double along_mm = finger.planned_mm + finger.position_mm;
      if (!(along_mm > from_mm - kFinger_mm && along_mm < to_mm + kFinger_mm)) continue;
      const to::LocalMap local =
          shown.map.Near({shown.structure.middle.u_mm + (shown.is_x ? along_mm : 0),
                          shown.structure.middle.v_mm + (shown.is_x ? 0 : along_mm)});
      DrawFinger(canvas, shown, window, local, finger);
    }
    canvas.Unclip();
    canvas.StrokeRect(rect, {.color = kMuted, .width_px = 0.8});
  }
  return top + rows * (row_px + kRowGapPx);
}

/// What data fill of a plot in the room.
RectPx Inner(const RectPx& room) {
  return {kPlotLeftPx, room.y + kPlotTopPx, room.width - kPlotLeftPx - kSidePx,
          room.height - kPlotTopPx - kPlotGapPx};
}

Axis AlongAxis(const Shown& shown) {
  return {fmt::format("along {} from the structure's middle (mm)", shown.is_x ? "u" : "v"),
          {-shown.half_mm, shown.half_mm},
          shown.broad ? 10 : 5};
}

void DrawFingerDot(Plot& plot, const to::FingerReading& finger, double y_um) {
  const Color& color = kCombColors[finger.comb];
  if (finger.comb == 0) {
    plot.Dot({finger.planned_mm, y_um}, 3.2, color);
  } else {
    plot.Dot({finger.planned_mm, y_um}, 3.2, kPaper, Stroke{.color = color, .width_px = 1.6});
  }
}

void DrawResiduals(Canvas& canvas, const Shown& shown, const RectPx& room) {
  std::vector<double> values{-1, 1};
  for (const to::FingerReading& finger : shown.reading.fingers) {
    if (finger.left_out.empty()) values.push_back(finger.residual_mm * kUmPerMm);
  }
  const Range range = Padded(RangeOf(values), 0.15);
  Plot plot =
      Plot::Around(canvas, Inner(room), AlongAxis(shown), {"residual (µm)", range, 5},
                   fmt::format("{}, rms {:.1f} µm; ×: left out",
                               shown.broad ? "What the fit leaves of each tooth" : "What is left",
                               shown.reading.residual_rms_mm * kUmPerMm));
  plot.HorizontalLine(0, {.color = kMuted, .width_px = 1});
  for (const to::FingerReading& finger : shown.reading.fingers) {
    if (finger.left_out.empty()) {
      DrawFingerDot(plot, finger, finger.residual_mm * kUmPerMm);
      continue;
    }
    Cross(canvas, plot.At({finger.planned_mm, range.lo + 0.08 * (range.hi - range.lo)}), 3.5,
          {.color = kInk, .width_px = 1.6});
  }
}

std::string LeftOutWords(const Shown& shown) {
  std::string text;
  for (const to::FingerReading& finger : shown.reading.fingers) {
    if (finger.left_out.empty()) continue;
    text += fmt::format("{}{}, tooth {}: {}", text.empty() ? " Left out: " : "; ",
                        finger.comb == 0 ? "blue" : "orange", finger.finger, finger.left_out);
  }
  return text.empty() ? " No tooth was left out." : text + ".";
}

std::string Caption(const Shown& shown) {
  if (shown.reading.fingers.empty()) {
    return fmt::format("{}: {}. No teeth were read; the picture shows where they should be.",
                       shown.reading.name, shown.reading.offset_mm.reason());
  }
  std::string text = fmt::format(
      "Blue: comb of {}, read in {}; orange: comb of {}, read in {}. Each coloured line must lie "
      "in "
      "the middle of a printed leg; numbers count the teeth.",
      CombName(shown.structure.combs[0]), shown.reading.channel[0],
      CombName(shown.structure.combs[1]), shown.reading.channel[1]);
  if (!shown.reading.offset_mm.good()) {
    text += fmt::format(" {}: {}.", VerdictWords(shown.reading.offset_mm.verdict()),
                        shown.reading.offset_mm.reason());
  }
  return text + LeftOutWords(shown);
}

std::string NameOf(const Shown& shown) {
  const to::Comb& first = shown.structure.combs[0];
  const to::Comb& second = shown.structure.combs[1];
  // The legs of an original sheet are drawn there and back, its combs one way.
  const char* drawn = shown.plan.original ? "stepped" : "legs";
  return fmt::format("{}: {} ({} {}) minus {} ({} {}) along {}", shown.reading.name,
                     CombName(second), drawn, second.direction > 0 ? "+" : "−", CombName(first),
                     drawn, first.direction > 0 ? "+" : "−", shown.is_x ? "u" : "v");
}

/// In how many rows a structure is shown: as many as keep them at most 40 mm long, on a phone 20,
/// or fewer where that would make the figure too high.
int RowsOf(double half_mm, double half_thickness_mm, double width_px) {
  const double most_row_mm = width_px < kFigureWidthPx ? 20 : 40;
  constexpr double kMostPx = 6000;
  int rows = static_cast<int>(std::ceil(2 * half_mm / most_row_mm));
  const auto height_px = [&](int count) {
    const double px_per_mm = (width_px - 2 * kSidePx) * count / (2 * half_mm);
    return count * (2 * half_thickness_mm * px_per_mm + kRowGapPx);
  };
  while (rows > 1 && height_px(rows) > kMostPx) --rows;
  return rows;
}

Canvas Draw(Shown shown, double width_px) {
  constexpr double kBeside_mm = 1.3;  // room for the teeth's numbers
  constexpr double kBeyond_mm = 0.8;
  shown.broad = width_px >= kFigureWidthPx;
  const double top_px = shown.broad ? 28 : 44;
  const to::SheetSettings& settings = shown.plan.settings;
  shown.half_mm = settings.teeth * settings.pitch_mm / 2 + kBeyond_mm;
  shown.inner_mm = settings.overlap_mm / 2;
  shown.outer_mm = settings.leg_length_mm - shown.inner_mm;
  const int rows = RowsOf(shown.half_mm, shown.outer_mm + kBeside_mm, width_px);
  const double px_per_mm = (width_px - 2 * kSidePx) * rows / (2 * shown.half_mm);
  const double row_px = 2 * (shown.outer_mm + kBeside_mm) * px_per_mm;
  const bool read = !shown.reading.fingers.empty();
  Canvas canvas(width_px, top_px + rows * (row_px + kRowGapPx) + (read ? kPlotPx + 36 : 0));
  const std::string name = NameOf(shown);
  const std::string value = OffsetWords(shown.reading.offset_mm);
  const TextStyle title{.size_px = shown.broad ? 13.5 : 11.5, .bold = true};
  canvas.Text({kSidePx, 18}, shown.broad ? name + ": " + value : name, title);
  if (!shown.broad) canvas.Text({kSidePx, 34}, value, title);
  const double top = DrawRows(canvas, shown, rows, row_px, top_px);
  if (read) {
    DrawResiduals(canvas, shown, {0, top, width_px, kPlotPx});
  }
  return canvas;
}

}  // namespace

Figure StructureFigure(const PageView& page, const to::SheetPlan& plan,
                       const to::SheetResult& result, const to::StructureReading& reading) {
  const to::Structure& structure = plan.structures[reading.structure];
  const to::PageMap& map = result.sheet.map;
  const Shown shown{page, plan, map, structure, reading, structure.axis == to::Axis::kX};
  return {SlugOf(reading.name),
          Caption(shown),
          Draw(shown, kFigureWidthPx),
          2,
          NameOf(shown) + ": " + OffsetWords(reading.offset_mm),
          Draw(shown, kNarrowWidthPx)};
}

}  // namespace trammel::report
