#include "document/scale_key.h"

#include <fmt/format.h>

#include <cmath>

#include "base/check.h"

namespace trammel::report {

double RoundedDown(double most) {
  TRAMMEL_CHECK(std::isfinite(most) && most > 0, "most = {}", most);
  constexpr double kSlack = 1 + 1e-9;  // so that 0.02 stays 0.02
  const double power = std::pow(10.0, std::floor(std::log10(most * kSlack)));
  for (const double factor : {5.0, 2.0}) {
    if (factor * power <= most * kSlack) return factor * power;
  }
  return power;
}

double DrawScaleKey(Canvas& canvas, const PointPx& at, double px_per_unit, double most_px,
                    const std::string& unit, const Stroke& stroke) {
  constexpr double kTextPx = 12;
  constexpr double kEndPx = 4;   // half of the bar's end strokes
  constexpr double kRisePx = 4;  // of the bar above the baseline
  constexpr double kGapPx = 6;
  const double value = RoundedDown(most_px / px_per_unit);
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
