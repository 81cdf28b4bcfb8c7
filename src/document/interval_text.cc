#include "document/interval_text.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

namespace trammel::report {
namespace {

constexpr int kMaxDecimals = 6;

int Decimals(const Interval& interval95, const IntervalStyle& style) {
  const double half = (interval95.hi - interval95.lo) / 2 * std::abs(style.scale);
  if (!(half > 0) || !std::isfinite(half)) return style.min_decimals;
  const int two_digits = static_cast<int>(1 - std::floor(std::log10(half)));
  return std::clamp(two_digits, style.min_decimals, std::max(style.min_decimals, kMaxDecimals));
}

std::string Unit(const IntervalStyle& style) { return style.unit.empty() ? "" : " " + style.unit; }

}  // namespace

std::string NumberText(double value, int decimals, bool signs) {
  std::string text = fmt::format("{:.{}f}", value, decimals);
  if (text.find_first_of("123456789") == std::string::npos && text.front() == '-') text.erase(0, 1);
  return signs && text.front() != '-' ? "+" + text : text;
}

std::string ValueText(double value, const Interval& interval95, const IntervalStyle& style) {
  return NumberText(value * style.scale, Decimals(interval95, style), style.signs) + Unit(style);
}

IntervalStyle StyleOfUnit(const std::string& unit) {
  return unit == "rad" ? kPerMille : IntervalStyle{.unit = unit};
}

std::string IntervalText(const Interval& interval95, const IntervalStyle& style) {
  const int decimals = Decimals(interval95, style);
  const double a = interval95.lo * style.scale;
  const double b = interval95.hi * style.scale;
  return fmt::format("95 %: {} to {}{}", NumberText(std::min(a, b), decimals, style.signs),
                     NumberText(std::max(a, b), decimals, style.signs), Unit(style));
}

std::string WithinText(std::span<const double> half_widths95, const IntervalStyle& style) {
  std::string text;
  for (const double half : half_widths95) {
    text += fmt::format("{}{:.{}f}", text.empty() ? "" : ", ", half * std::abs(style.scale),
                        Decimals({-half, half}, style));
  }
  return "95 %: within " + text + Unit(style);
}

std::string WithInterval(double value, const Interval& interval95, const IntervalStyle& style) {
  return fmt::format("{} ({})", ValueText(value, interval95, style),
                     IntervalText(interval95, style));
}

Interval NormalInterval95(double value, double standard_uncertainty) {
  return {value - kNormal95 * standard_uncertainty, value + kNormal95 * standard_uncertainty};
}

}  // namespace trammel::report
