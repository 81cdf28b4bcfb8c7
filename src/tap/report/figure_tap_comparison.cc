// How two methods repeat on the same taps.
#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "document/interval_text.h"
#include "document/plot.h"
#include "tap/report/comparison_report.h"
#include "tap/report/tap_style.h"

namespace trammel::report {
namespace {

using Residuals = std::vector<DataPoint>;

Residuals ResidualsOf(const tap::MethodComparison& comparison,
                      tap::TapResult tap::TwiceRead::*method) {
  Residuals points;
  for (std::size_t i = 0; i < comparison.residuals.size(); ++i) {
    const double height_mm = (comparison.residuals[i].*method).z_mm;
    if (!std::isfinite(height_mm)) continue;
    points.push_back({static_cast<double>(i + 1), height_mm * kUmPerMm});
  }
  return points;
}

double Largest(const Residuals& points) {
  double largest = 0;
  for (const DataPoint& point : points) largest = std::max(largest, std::abs(point.y));
  return largest;
}

/// Whole numbers only.
Axis TapAxis(std::size_t taps, int ticks) {
  Axis axis{"tap", {0.5, static_cast<double>(taps) + 0.5}, ticks};
  for (const double tick : NiceTicks(axis.range, ticks)) {
    if (tick == std::floor(tick)) axis.fixed.push_back(tick);
  }
  return axis;
}

std::string NameOf(const char* method, const tap::MethodScatter& scatter) {
  if (!scatter.deviation_mm.good()) return method;
  return fmt::format("{}, deviation {:.2f} µm", method,
                     scatter.deviation_mm.quantity().value * kUmPerMm);
}

/// A panel for each method over the same heights, one above the other.
Canvas Draw(const tap::MethodComparison& comparison, double width_px) {
  constexpr double kPanelPx = 210;
  constexpr double kFewTaps = 60;  // more of them join into a band when lines link them
  const Residuals two_line = ResidualsOf(comparison, &tap::TwiceRead::two_line);
  const Residuals contact = ResidualsOf(comparison, &tap::TwiceRead::contact);
  const double most = 1.1 * std::max({Largest(two_line), Largest(contact), 0.01});
  Canvas canvas(width_px, 2 * kPanelPx + 8);
  double top = 4;
  const auto panel = [&](const Residuals& points, const std::string& title, const Color& color) {
    Plot plot(canvas, {6, top, width_px - 12, kPanelPx},
              TapAxis(comparison.residuals.size(), width_px < kFigureWidthPx ? 5 : 10),
              {"height (µm)", {-most, most}, 5}, title);
    plot.HorizontalLine(0, {.color = kMuted, .width_px = 1});
    if (static_cast<double>(points.size()) <= kFewTaps && comparison.places == 1) {
      plot.Line(points, {.color = WithAlpha(color, 0.4), .width_px = 1});
    }
    for (const DataPoint& point : points) plot.Dot(point, 3, color);
    top += kPanelPx;
  };
  panel(contact, NameOf("contact", comparison.contact), kNewMethod);
  panel(two_line, NameOf("two-line", comparison.two_line), kOldMethod);
  return canvas;
}

}  // namespace

std::optional<Figure> ComparisonFigure(const tap::MethodComparison& comparison) {
  if (comparison.used == 0) return std::nullopt;
  Figure figure{
      "compare",
      "Contact height of each tap less the mean of its place, by trammel's contact and by "
      "the published decomposition, over the same heights. Taps that one of the two did "
      "not read are in neither.",
      Draw(comparison, kFigureWidthPx)};
  figure.seen =
      fmt::format("Heights of {} taps about the mean of their place. {}; {}.", comparison.used,
                  NameOf("contact", comparison.contact), NameOf("two-line", comparison.two_line));
  figure.narrow = Draw(comparison, kNarrowWidthPx);
  return figure;
}

}  // namespace trammel::report
