// Legends, colour bars and grids as pictures.
#include <algorithm>
#include <cmath>
#include <numbers>

#include "base/check.h"
#include "document/plot.h"

namespace trammel::report {
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
                 double most_px) {
  TextStyle fitted = style;
  fitted.size_px *= std::min(1.0, most_px / std::max(1.0, canvas.TextWidth(text, style)));
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
    // A name longer than a row is set smaller, not cut off.
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

}  // namespace trammel::report
