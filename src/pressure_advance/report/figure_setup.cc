// What the camera saw on its set-up, and what was read in it.
#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <utility>
#include <vector>

#include "document/interval_text.h"
#include "document/plot.h"
#include "pressure_advance/report/setup_report.h"

namespace trammel::report {
namespace {

namespace pa = pressure_advance;

constexpr double kBesidePx = 8;
constexpr double kCurvesPx = 250;

// Both lights in one picture: of each pixel the brighter.
Frame Overlay(const SetupView& view) {
  const auto has = [](const Frame* frame) { return frame != nullptr && !frame->bgr.empty(); };
  if (!has(view.lit)) return has(view.laser) ? *view.laser : Frame();
  Frame both = *view.lit;
  if (!has(view.laser) || view.laser->bgr.size() != both.bgr.size()) return both;
  for (std::size_t i = 0; i < both.bgr.size(); ++i) {
    both.bgr[i] = std::max(both.bgr[i], view.laser->bgr[i]);
  }
  return both;
}

// Draws in the picture's own pixels.
class OnPicture {
 public:
  OnPicture(Canvas& canvas, const RectPx& rect, double scale)
      : canvas_(canvas), rect_(rect), scale_(scale) {}

  [[nodiscard]] PointPx At(double column, double row) const {
    return {rect_.x + (column + 0.5) * scale_, rect_.y + (row + 0.5) * scale_};
  }
  // Light on dark, so that it is seen on any plate.
  void Line(std::vector<PointPx> points, const Color& color) const {
    canvas_.Polyline(points, {.color = kOnLight, .width_px = 3.5});
    canvas_.Polyline(points, {.color = color, .width_px = 1.5});
  }
  void Name(const PointPx& at, const std::string& text, Align align = Align::kStart) const {
    const TextStyle style{.size_px = 12, .color = kOnDark, .align = align, .bold = true};
    const double width = canvas_.TextWidth(text, style);
    const double left = align == Align::kEnd      ? at.x - width
                        : align == Align::kMiddle ? at.x - width / 2
                                                  : at.x;
    canvas_.FillRect({left - 3, at.y - 12, width + 6, 16}, WithAlpha(kOnLight, 0.7));
    canvas_.Text(at, text, style);
  }
  void Arrow(const PointPx& from, const PointPx& tip, const Color& color) const {
    DrawArrow(canvas_, from, tip, {.color = kOnLight, .width_px = 5}, 14);
    DrawArrow(canvas_, from, tip, {.color = color, .width_px = 2.5}, 12);
  }

 private:
  Canvas& canvas_;
  RectPx rect_;
  double scale_;
};

void DrawCrop(const OnPicture& picture, const PixelRect& crop) {
  const double left = crop.x - 0.5, top = crop.y - 0.5;
  const double right = left + crop.width, bottom = top + crop.height;
  picture.Line({picture.At(left, top), picture.At(right, top), picture.At(right, bottom),
                picture.At(left, bottom), picture.At(left, top)},
               kSky);
  const PointPx at = picture.At(right, top);
  picture.Name({at.x + 6, at.y + 12}, "crop");
}

void DrawStripe(const OnPicture& picture, const SetupView& view) {
  const auto& stripes = view.seen->stripes;
  const auto near = [&](const pa::PlacedStripe& stripe) {
    return stripe.reading.fault.empty() ? std::abs(stripe.head.z_mm - view.seen->height_mm) : 1e9;
  };
  const auto shown = std::ranges::min_element(stripes, {}, near);
  if (shown == stripes.end() || !shown->reading.fault.empty()) return;
  const pa::StripeReading& reading = shown->reading;
  const double length = reading.down ? view.seen->picture.height_px : view.seen->picture.width_px;
  std::vector<PointPx> line;
  for (const double end : {0.0, length - 1}) {
    const double across = reading.at_middle_px + reading.slope * (end - 0.5 * (length - 1));
    line.push_back(reading.down ? picture.At(across, end) : picture.At(end, across));
  }
  picture.Line(line, kVermilion);
  picture.Name({line.back().x - 6, line.back().y - 6}, "laser", Align::kEnd);
}

void DrawMark(const OnPicture& picture, const pa::MarkReading& mark) {
  if (!mark.fault.empty()) return;
  std::vector<PointPx> outline;
  for (const auto& corner : mark.corners) outline.push_back(picture.At(corner.x, corner.y));
  outline.push_back(outline.front());
  picture.Line(outline, kGreen);
  const auto left = std::ranges::min(outline, {}, &PointPx::x);
  picture.Name({left.x - 6, left.y}, "mark", Align::kEnd);
}

// The plate's axes: where a place with a larger coordinate stands in the picture.
void DrawAxes(const OnPicture& picture, const SetupView& view) {
  const auto& fit = view.result->scale.fit;
  if (!view.result->scale.px_per_mm.good() || !fit) return;
  const double column = 0.18 * view.seen->picture.width_px;
  const double row = 0.62 * view.seen->picture.height_px;
  const double scale = view.result->scale.px_per_mm.quantity().value;
  const double length = 0.2 * view.seen->picture.height_px / scale;  // mm
  const PointPx from = picture.At(column, row);
  for (const auto& [name, first] : {std::pair{"X", 2}, std::pair{"Y", 4}}) {
    const PointPx tip =
        picture.At(column - length * fit->value[first], row - length * fit->value[first + 1]);
    picture.Arrow(from, tip, kOnDark);
    const double off = std::hypot(tip.x - from.x, tip.y - from.y);
    picture.Name({tip.x + 14 * (tip.x - from.x) / off, tip.y + 14 * (tip.y - from.y) / off + 5},
                 name, Align::kMiddle);
  }
}

void DrawSpot(const OnPicture& picture, const SetupView& view) {
  if (!view.result->height.px_per_height_mm.good()) return;
  const PointPx at = picture.At(view.result->spot_column_px, view.result->spot_row_px);
  constexpr double kArm = 9;
  picture.Line({{at.x - kArm, at.y}, {at.x + kArm, at.y}}, kOnDark);
  picture.Line({{at.x, at.y - kArm}, {at.x, at.y + kArm}}, kOnDark);
}

// The stripe over the nozzle's height: its width, which tells the focus, and its place.
void DrawCurves(Canvas& canvas, const RectPx& room, const SetupView& view, bool width) {
  const Measured& focus = view.result->focus_mm;
  const Measured& scale = view.result->scale.px_per_mm;
  const auto perspective = view.result->height.perspective.value_or(pa::Perspective{});
  // On the plate, as the focus is found; in pixels where the scale is not known.
  const double per_px = scale.good() ? kUmPerMm / scale.quantity().value : 1;
  std::vector<DataPoint> up, down;
  std::vector<double> x, y;
  for (const pa::PlacedStripe& stripe : view.seen->stripes) {
    if (!stripe.reading.fault.empty()) continue;
    const double z_mm = stripe.head.z_mm;
    const double width_um = per_px * perspective.Shrinks(z_mm) * stripe.reading.width_px;
    const DataPoint point{z_mm, width ? width_um : stripe.reading.across_px};
    (stripe.head.from_z >= 0 ? up : down).push_back(point);
    x.push_back(point.x);
    y.push_back(point.y);
  }
  Plot plot(canvas, room, {.label = "nozzle's height (mm)", .range = Padded(RangeOf(x), 0.04)},
            {.label = !width         ? "stripe's place (px)"
                      : scale.good() ? "stripe's width on the plate (µm, 1 σ)"
                                     : "stripe's width on the plate (px, 1 σ)",
             .range = Padded(RangeOf(y), 0.1)},
            width ? "Focus" : "Height");
  if (focus.good() && width) {
    const Interval& interval = focus.quantity().interval95;
    plot.ShadeX({interval.lo, interval.hi}, WithAlpha(kSky, 0.5));
    plot.VerticalLine(focus.quantity().value, {.color = kBlue});
  }
  const Measured& shift = view.result->height.px_per_height_mm;
  if (!width && shift.good()) {
    const double z_mm = view.seen->height_mm;
    std::vector<DataPoint> line;
    for (const double end : {RangeOf(x).lo, RangeOf(x).hi}) {
      line.push_back({end, view.result->height.across_px + shift.quantity().value * (end - z_mm)});
    }
    plot.Line(line, {.color = kGrey, .dash_px = {5, 4}});
  }
  for (const DataPoint& point : up) plot.Dot(point, 3.5, kBlue);
  for (const DataPoint& point : down) plot.Dot(point, 3.5, kPaper, Stroke{.color = kBlue});
}

Canvas DrawSetup(const SetupView& view, const Frame& both, double width_px) {
  const double scale = (width_px - 2 * kBesidePx) / both.width;
  const RectPx rect{kBesidePx, 6, both.width * scale, both.height * scale};
  const bool broad = width_px >= kFigureWidthPx;
  const bool curves = !view.seen->stripes.empty();
  const double below = curves ? (broad ? 1 : 2) * kCurvesPx : 0;
  Canvas canvas(width_px, rect.bottom() + 10 + below);
  canvas.Image(both.view(), rect, Pixels::kPhoto);
  canvas.Clip(rect);
  const OnPicture picture(canvas, rect, scale);
  DrawStripe(picture, view);
  if (view.brought != nullptr) DrawMark(picture, *view.brought);
  if (view.result->crop) DrawCrop(picture, *view.result->crop);
  DrawAxes(picture, view);
  DrawSpot(picture, view);
  canvas.Unclip();
  if (!curves) return canvas;
  for (const bool width : {true, false}) {
    const double number = width ? 0 : 1;
    const double panel = broad ? width_px / 2 : width_px;
    DrawCurves(canvas,
               {(broad ? number * panel : 0) + 4,
                rect.bottom() + 10 + (broad ? 0 : number * kCurvesPx), panel - 8, kCurvesPx - 6},
               view, width);
  }
  return canvas;
}

}  // namespace

std::optional<Figure> SetupFigure(const SetupView& view) {
  const Frame both = Overlay(view);
  if (both.bgr.empty()) return std::nullopt;
  Figure figure{
      "setup",
      "The camera's picture with the mark brought to where the laser meets the plate, taken with "
      "the lights on and by the laser alone, one laid over the other. The cross is the laser's "
      "place, from which the offset counts; the arrows show where on the plate x and y become "
      "larger. Below: the stripe's width over the nozzle's height, by which the focus is found "
      "(line, and its 95 % interval), and its place, by which heights are. Full dots were reached "
      "from below, open ones from above: where they part, there is play.",
      DrawSetup(view, both, kFigureWidthPx), 1.5};
  figure.seen = fmt::format(
      "The camera's picture of {} by {} px with the laser's stripe{} in it, and two plots of the "
      "stripe over the nozzle's height from {} readings.",
      both.width, both.height, view.result->crop ? ", the crop and the printed mark" : "",
      view.seen->stripes.size());
  figure.narrow = DrawSetup(view, both, kNarrowWidthPx);
  return figure;
}

}  // namespace trammel::report
