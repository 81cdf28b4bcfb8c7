#include "document/plot.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <numbers>

#include "base/check.h"

namespace trammel::report {
namespace {

constexpr double kTickLengthPx = 4;
constexpr double kGapPx = 6;
constexpr int kMaxDecimals = 9;

double Step(const Range& range, int wanted) {
  const double raw = (range.hi - range.lo) / wanted;
  const double power = std::pow(10.0, std::floor(std::log10(raw)));
  for (const double factor : {1.0, 2.0, 5.0}) {
    if (factor * power >= raw * (1 - 1e-9)) {
      return factor * power;
    }
  }
  return 10 * power;
}

std::vector<double> Ticks(const Axis& axis) {
  if (!axis.shown) {
    return {};
  }
  return axis.fixed.empty() ? NiceTicks(axis.range, axis.ticks) : axis.fixed;
}

double RoomLeft(const Canvas& canvas, const Axis& axis) {
  double widest = 0;
  for (const std::string& label : TickLabels(Ticks(axis))) {
    widest = std::max(widest, canvas.TextWidth(label, {.size_px = kTickTextPx}));
  }
  return (axis.label.empty() ? 0 : kLabelTextPx + kGapPx) +
         (axis.shown ? widest + kTickLengthPx + kGapPx : 0);
}

double RoomBelow(const Axis& axis) {
  return (axis.label.empty() ? 0 : kLabelTextPx + kGapPx) +
         (axis.shown ? kTickTextPx + kTickLengthPx + kGapPx / 2 : 0);
}

}  // namespace

Range RangeOf(std::span<const double> values) {
  Range range{0, 1};
  bool any = false;
  for (const double value : values) {
    if (std::isfinite(value)) {
      range =
          any ? Range{std::min(range.lo, value), std::max(range.hi, value)} : Range{value, value};
      any = true;
    }
  }
  // Below this width, neighbouring ticks would be equal in double precision.
  const double least = 1e-6 * std::max({std::abs(range.lo), std::abs(range.hi), 1e-6});
  if (range.hi - range.lo < least) {
    const double half = std::max(0.05 * std::abs(range.lo), least);
    return {range.lo - half, range.hi + half};
  }
  return range;
}

Range Join(const Range& a, const Range& b) { return {std::min(a.lo, b.lo), std::max(a.hi, b.hi)}; }

Range Padded(const Range& range, double fraction) {
  const double pad = fraction * (range.hi - range.lo);
  return {range.lo - pad, range.hi + pad};
}

std::pair<Range, Range> WithOneScale(const Range& x, const Range& y, double width_px,
                                     double height_px, double spare, double least) {
  const double per_px =
      spare * std::max({(x.hi - x.lo) / width_px, (y.hi - y.lo) / height_px, least});
  const auto around = [per_px](const Range& range, double px) {
    const double middle = (range.lo + range.hi) / 2;
    return Range{middle - per_px * px / 2, middle + per_px * px / 2};
  };
  return {around(x, width_px), around(y, height_px)};
}

std::vector<double> NiceTicks(const Range& range, int wanted) {
  TRAMMEL_CHECK(range.lo < range.hi && std::isfinite(range.hi - range.lo) && wanted >= 1,
                "range = [{}, {}], wanted = {}", range.lo, range.hi, wanted);
  constexpr std::size_t kMin = 2;  // one alone gives no scale
  constexpr int kFinest = 10;
  const double slack = 1e-6;
  std::vector<double> ticks;
  for (int finer = wanted; ticks.size() < kMin && finer <= kFinest * wanted; ++finer) {
    const double step = Step(range, finer);
    const double last = std::floor(range.hi / step + slack);
    ticks.clear();
    for (double i = std::ceil(range.lo / step - slack); i <= last; ++i) ticks.push_back(i * step);
  }
  return ticks;
}

std::vector<std::string> TickLabels(const std::vector<double>& ticks) {
  double step = ticks.empty() ? 1 : std::abs(ticks.front());
  for (std::size_t i = 1; i < ticks.size(); ++i) {
    step = i == 1 ? ticks[1] - ticks[0] : std::min(step, ticks[i] - ticks[i - 1]);
  }
  int decimals = 0;
  for (double unit = 1; step > 0 && decimals < kMaxDecimals &&
                        std::abs(step / unit - std::round(step / unit)) > 1e-3 * step / unit;
       unit /= 10) {
    ++decimals;
  }
  std::vector<std::string> labels;
  for (const double tick : ticks) {
    const double shown = std::abs(tick) < 1e-9 * step ? 0.0 : tick;
    labels.push_back(std::abs(shown) >= 1e6 ? fmt::format("{:.4g}", shown)
                                            : fmt::format("{:.{}f}", shown + 0.0, decimals));
  }
  return labels;
}

Plot::Plot(Canvas& canvas, const Axis& x, const Axis& y)
    : canvas_(&canvas), x_range_(x.range), y_range_(y.range) {
  TRAMMEL_CHECK(x.range.lo < x.range.hi && y.range.lo < y.range.hi, "x = [{}, {}], y = [{}, {}]",
                x.range.lo, x.range.hi, y.range.lo, y.range.hi);
}

Plot::Plot(Canvas& canvas, const RectPx& outer, const Axis& x, const Axis& y,
           const std::string& title)
    : Plot(canvas, x, y) {
  const double left = RoomLeft(canvas, y);
  const double above = title.empty() ? kGapPx : kTitleTextPx + kGapPx + 2;
  const double right = 2 * kGapPx;  // half of the last tick's label
  inner_ = {outer.x + left, outer.y + above, std::max(1.0, outer.width - left - right),
            std::max(1.0, outer.height - above - RoomBelow(x))};
  Draw(x, y, title);
}

Plot Plot::Around(Canvas& canvas, const RectPx& inner, const Axis& x, const Axis& y,
                  const std::string& title) {
  Plot plot(canvas, x, y);
  plot.inner_ = inner;
  plot.Draw(x, y, title);
  return plot;
}

void Plot::Draw(const Axis& x, const Axis& y, const std::string& title) {
  // Limits the title's width, so that it does not overlap the plot's neighbours.
  TextStyle style{.size_px = kTitleTextPx, .bold = true};
  const double width = canvas_->TextWidth(title, style);
  if (width > inner_.width) style.size_px *= std::max(0.5, inner_.width / width);
  canvas_->Text({inner_.x, inner_.y - kGapPx - 2}, title, style);
  DrawXAxis(x);
  DrawYAxis(y);
}

void Plot::DrawXAxis(const Axis& axis) {
  const std::vector<double> ticks = Ticks(axis);
  const std::vector<std::string> labels = TickLabels(ticks);
  for (std::size_t i = 0; i < ticks.size(); ++i) {
    const double at = X(ticks[i]);
    const PointPx grid[] = {{at, inner_.y}, {at, inner_.bottom()}};
    const PointPx tick[] = {{at, inner_.bottom()}, {at, inner_.bottom() + kTickLengthPx}};
    canvas_->Polyline(grid, {.color = kGrid, .width_px = 1});
    canvas_->Polyline(tick, {.color = kMuted, .width_px = 1});
    canvas_->Text({at, inner_.bottom() + kTickLengthPx + kTickTextPx + 1}, labels[i],
                  {.size_px = kTickTextPx, .color = kMuted, .align = Align::kMiddle});
  }
  if (axis.shown) {
    const PointPx edge[] = {{inner_.x, inner_.bottom()}, {inner_.right(), inner_.bottom()}};
    canvas_->Polyline(edge, {.color = kMuted, .width_px = 1});
  }
  canvas_->Text({inner_.x + inner_.width / 2, inner_.bottom() + RoomBelow(axis) - 3}, axis.label,
                {.size_px = kLabelTextPx, .color = kMuted, .align = Align::kMiddle});
}

void Plot::DrawYAxis(const Axis& axis) {
  const std::vector<double> ticks = Ticks(axis);
  const std::vector<std::string> labels = TickLabels(ticks);
  for (std::size_t i = 0; i < ticks.size(); ++i) {
    const double at = Y(ticks[i]);
    const PointPx grid[] = {{inner_.x, at}, {inner_.right(), at}};
    const PointPx tick[] = {{inner_.x - kTickLengthPx, at}, {inner_.x, at}};
    canvas_->Polyline(grid, {.color = kGrid, .width_px = 1});
    canvas_->Polyline(tick, {.color = kMuted, .width_px = 1});
    canvas_->Text({inner_.x - kTickLengthPx - 3, at + 0.36 * kTickTextPx}, labels[i],
                  {.size_px = kTickTextPx, .color = kMuted, .align = Align::kEnd});
  }
  if (axis.shown) {
    const PointPx edge[] = {{inner_.x, inner_.y}, {inner_.x, inner_.bottom()}};
    canvas_->Polyline(edge, {.color = kMuted, .width_px = 1});
  }
  canvas_->Text(
      {inner_.x - RoomLeft(*canvas_, axis) + kLabelTextPx - 2, inner_.y + inner_.height / 2},
      axis.label,
      {.size_px = kLabelTextPx,
       .color = kMuted,
       .align = Align::kMiddle,
       .angle_rad = -std::numbers::pi / 2});
}

double Plot::X(double x) const {
  return inner_.x + (x - x_range_.lo) / (x_range_.hi - x_range_.lo) * inner_.width;
}

double Plot::Y(double y) const {
  return inner_.bottom() - (y - y_range_.lo) / (y_range_.hi - y_range_.lo) * inner_.height;
}

void Plot::Line(std::span<const DataPoint> points, const Stroke& stroke) {
  std::vector<PointPx> path;
  path.reserve(points.size());
  for (const DataPoint& point : points) {
    path.push_back(At(point));
  }
  const bool inside =
      std::all_of(path.begin(), path.end(), [this](const PointPx& point) { return Holds(point); });
  if (!inside) canvas_->Clip(inner_);
  canvas_->Polyline(path, stroke);
  if (!inside) canvas_->Unclip();
}

bool Plot::Holds(const PointPx& point) const {
  constexpr double kSlackPx = 1e-6;
  return point.x >= inner_.x - kSlackPx && point.x <= inner_.right() + kSlackPx &&
         point.y >= inner_.y - kSlackPx && point.y <= inner_.bottom() + kSlackPx;
}

void Plot::Band(std::span<const DataPoint> lower, std::span<const DataPoint> upper,
                const Color& fill) {
  std::vector<PointPx> outline;
  for (const DataPoint& point : lower) {
    outline.push_back(At(point));
  }
  for (auto point = upper.rbegin(); point != upper.rend(); ++point) {
    outline.push_back(At(*point));
  }
  canvas_->Clip(inner_);
  canvas_->Polygon(outline, fill);
  canvas_->Unclip();
}

void Plot::ShadeX(const Range& range, const Color& fill) {
  const double from = std::clamp(X(range.lo), inner_.x, inner_.right());
  const double to = std::clamp(X(range.hi), inner_.x, inner_.right());
  if (to > from) {
    canvas_->FillRect({from, inner_.y, to - from, inner_.height}, fill);
  }
}

void Plot::VerticalLine(double x, const Stroke& stroke) {
  const DataPoint points[] = {{x, y_range_.lo}, {x, y_range_.hi}};
  Line(points, stroke);
}

void Plot::HorizontalLine(double y, const Stroke& stroke) {
  const DataPoint points[] = {{x_range_.lo, y}, {x_range_.hi, y}};
  Line(points, stroke);
}

void Plot::Dot(const DataPoint& point, double radius_px, const std::optional<Color>& fill,
               const std::optional<Stroke>& edge) {
  if (Holds(At(point))) canvas_->Circle(At(point), radius_px, fill, edge);
}

void Plot::Diamond(const DataPoint& point, double radius_px, const Color& fill) {
  if (Holds(At(point))) DrawDiamond(*canvas_, At(point), radius_px, fill);
}

void Plot::ErrorBar(const DataPoint& point, double half, const Stroke& stroke) {
  constexpr double kCapPx = 3;
  const PointPx low = At({point.x, point.y - half});
  const PointPx high = At({point.x, point.y + half});
  const PointPx bar[] = {low, high};
  canvas_->Clip(inner_);
  canvas_->Polyline(bar, stroke);
  for (const PointPx& end : {low, high}) {
    const PointPx cap[] = {{end.x - kCapPx, end.y}, {end.x + kCapPx, end.y}};
    canvas_->Polyline(cap, stroke);
  }
  canvas_->Unclip();
}

namespace {

constexpr double kMarkWidthPx = 22;
constexpr double kRowPx = 19;

void DrawMark(Canvas& canvas, const PointPx& at, const LegendEntry& entry) {
  const double middle = at.y - 0.36 * kTickTextPx;
  const PointPx line[] = {{at.x, middle}, {at.x + kMarkWidthPx, middle}};
  const PointPx centre{at.x + kMarkWidthPx / 2, middle};
  switch (entry.mark) {
    case LegendEntry::Mark::kLine:
      canvas.Polyline(line, entry.stroke);
      return;
    case LegendEntry::Mark::kDot:
      canvas.Circle(centre, 4, entry.stroke.color);
      return;
    case LegendEntry::Mark::kHollowDot:
      canvas.Circle(centre, 4, kPaper, Stroke{.color = entry.stroke.color});
      return;
    case LegendEntry::Mark::kDiamond:
      DrawDiamond(canvas, centre, 6, entry.stroke.color);
      return;
    case LegendEntry::Mark::kPatch:
      canvas.FillRect({at.x, middle - 6, kMarkWidthPx, 12}, entry.stroke.color);
      return;
  }
}

std::uint8_t Byte(double value) { return static_cast<std::uint8_t>(std::lround(value * 255)); }

}  // namespace

void DrawArrow(Canvas& canvas, const PointPx& from, const PointPx& tip, const Stroke& shaft,
               double head_px) {
  const double length = std::hypot(tip.x - from.x, tip.y - from.y);
  if (!(length > 1)) return;
  const double head = std::min(head_px, length);
  const double x = (tip.x - from.x) / length * head;
  const double y = (tip.y - from.y) / length * head;
  const PointPx neck{tip.x - x, tip.y - y};
  const PointPx line[] = {from, neck};
  canvas.Polyline(line, shaft);
  const PointPx corners[] = {
      tip, {neck.x - 0.4 * y, neck.y + 0.4 * x}, {neck.x + 0.4 * y, neck.y - 0.4 * x}};
  canvas.Polygon(corners, shaft.color);
}

TextStyle Fitted(const Canvas& canvas, std::string_view text, const TextStyle& style,
                 double max_px) {
  TextStyle fitted = style;
  fitted.size_px *= std::min(1.0, max_px / std::max(1.0, canvas.TextWidth(text, style)));
  return fitted;
}

void DrawDiamond(Canvas& canvas, const PointPx& at, double radius_px, const Color& fill) {
  const PointPx corners[] = {{at.x - radius_px, at.y},
                             {at.x, at.y - radius_px},
                             {at.x + radius_px, at.y},
                             {at.x, at.y + radius_px}};
  canvas.Polygon(corners, fill, Stroke{.color = kPaper, .width_px = 1.5});
}

double DrawLegend(Canvas& canvas, const PointPx& at, double max_width_px,
                  std::span<const LegendEntry> entries) {
  constexpr double kAfterMarkPx = 6;
  constexpr double kAfterEntryPx = 18;
  PointPx cursor = at;
  for (const LegendEntry& entry : entries) {
    // Reduces a name longer than a row instead of truncating it.
    const TextStyle style = Fitted(canvas, entry.name, {.size_px = kTickTextPx},
                                   max_width_px - kMarkWidthPx - kAfterMarkPx);
    const double width = kMarkWidthPx + kAfterMarkPx + canvas.TextWidth(entry.name, style);
    if (cursor.x > at.x && cursor.x + width > at.x + max_width_px) {
      cursor = {at.x, cursor.y + kRowPx};
    }
    DrawMark(canvas, cursor, entry);
    canvas.Text({cursor.x + kMarkWidthPx + kAfterMarkPx, cursor.y}, entry.name, style);
    cursor.x += width + kAfterEntryPx;
  }
  return entries.empty() ? 0 : cursor.y - at.y + kRowPx;
}

Frame ColorGrid(const Grid& grid, const Range& range) {
  TRAMMEL_CHECK(grid.values.size() == grid.rows * grid.columns && range.lo < range.hi,
                "{} values for {} x {}, range [{}, {}]", grid.values.size(), grid.rows,
                grid.columns, range.lo, range.hi);
  Frame image(static_cast<int>(grid.columns), static_cast<int>(grid.rows));
  for (std::size_t i = 0; i < grid.values.size(); ++i) {
    const double value = grid.values[i];
    const Color color =
        std::isfinite(value) ? MapColor((value - range.lo) / (range.hi - range.lo)) : kUnseen;
    image.bgr[3 * i] = Byte(color.blue);
    image.bgr[3 * i + 1] = Byte(color.green);
    image.bgr[3 * i + 2] = Byte(color.red);
  }
  return image;
}

void DrawColorBar(Canvas& canvas, const RectPx& bar, const Range& range, const std::string& label) {
  constexpr std::size_t kSteps = 128;
  Grid grid{1, kSteps, {}};
  for (std::size_t i = 0; i < kSteps; ++i) {
    grid.values.push_back(1 - static_cast<double>(i) / (kSteps - 1));
  }
  canvas.Image(ColorGrid(grid, {0, 1}).view(), bar);
  canvas.StrokeRect(bar, {.color = kMuted, .width_px = 1});
  const std::vector<double> ticks =
      NiceTicks(range, std::max(2, static_cast<int>(bar.height / 40)));
  const std::vector<std::string> labels = TickLabels(ticks);
  double widest = 0;
  for (std::size_t i = 0; i < ticks.size(); ++i) {
    const double y = bar.bottom() - (ticks[i] - range.lo) / (range.hi - range.lo) * bar.height;
    const PointPx tick[] = {{bar.right(), y}, {bar.right() + 4, y}};
    canvas.Polyline(tick, {.color = kMuted, .width_px = 1});
    canvas.Text({bar.right() + 7, y + 0.36 * kTickTextPx}, labels[i],
                {.size_px = kTickTextPx, .color = kMuted});
    widest = std::max(widest, canvas.TextWidth(labels[i], {.size_px = kTickTextPx}));
  }
  canvas.Text({bar.right() + 7 + widest + 15, bar.y + bar.height / 2}, label,
              {.size_px = kLabelTextPx,
               .color = kMuted,
               .align = Align::kMiddle,
               .angle_rad = -std::numbers::pi / 2});
}

double RoundedDown(double most) {
  TRAMMEL_CHECK(std::isfinite(most) && most > 0, "most = {}", most);
  constexpr double kSlack = 1 + 1e-9;  // so that 0.02 stays 0.02
  const double power = std::pow(10.0, std::floor(std::log10(most * kSlack)));
  for (const double factor : {5.0, 2.0}) {
    if (factor * power <= most * kSlack) return factor * power;
  }
  return power;
}

double DrawScaleKey(Canvas& canvas, const PointPx& at, double px_per_unit, double max_px,
                    const std::string& unit, const Stroke& stroke) {
  constexpr double kTextPx = 12;
  constexpr double kEndPx = 4;   // half of the bar's end strokes
  constexpr double kRisePx = 4;  // height of the bar above the baseline
  constexpr double kGapPx = 6;
  const double value = RoundedDown(max_px / px_per_unit);
  const double right = at.x + value * px_per_unit;
  const double y = at.y - kRisePx;
  const PointPx bar[] = {{at.x, y}, {right, y}};
  canvas.Polyline(bar, stroke);
  for (const PointPx& end : bar) {
    const PointPx line[] = {{end.x, y - kEndPx}, {end.x, y + kEndPx}};
    canvas.Polyline(line, {.color = stroke.color, .width_px = 1});
  }
  const std::string text = fmt::format("{:g} {}", value, unit);
  const TextStyle style{.size_px = kTextPx};
  canvas.Text({right + kGapPx, at.y}, text, style);
  return right + kGapPx + canvas.TextWidth(text, style);
}

}  // namespace trammel::report
