// Text of a value and its 95 % interval: the same on every screen and page.
#pragma once

#include <span>
#include <string>

#include "base/measured.h"
#include "base/statistics.h"

namespace trammel::report {

inline constexpr double kUmPerMm = 1000;

/// Format of a quantity.
struct IntervalStyle {
  std::string unit = {};  ///< none: a bare number
  double scale = 1;       ///< displayed units per unit of the quantity
  int min_decimals = 4;   ///< more where half of the interval has less than two digits in them
  bool signs = false;     ///< a + before what is positive
};

/// "-0.0053"; never "-0.0000". @param signs  a + before what is not negative.
[[nodiscard]] std::string NumberText(double value, int decimals, bool signs);

/// "95 %: 0.0154 to 0.0190 s".
[[nodiscard]] std::string IntervalText(const Interval& interval95, const IntervalStyle& style);

/// "0.0172 s (95 %: 0.0154 to 0.0190 s)".
[[nodiscard]] std::string WithInterval(double value, const Interval& interval95,
                                       const IntervalStyle& style);
[[nodiscard]] inline std::string WithInterval(const Quantity& quantity,
                                              const IntervalStyle& style) {
  return WithInterval(quantity.value, quantity.interval95, style);
}

/// "0.0172 s", with the decimals that its interval has.
[[nodiscard]] std::string ValueText(double value, const Interval& interval95,
                                    const IntervalStyle& style);

/// "95 %: within 0.0653, 0.0572, 0.0602 mm" of values that stand beside it.
[[nodiscard]] std::string WithinText(std::span<const double> half_widths95,
                                     const IntervalStyle& style);

/// Computes the interval of a normal distribution with this standard uncertainty (k = 1), if
/// nothing better is known.
[[nodiscard]] Interval NormalInterval95(double value, double standard_uncertainty);

inline const IntervalStyle kPerMille{.unit = "mm/m", .scale = 1000};
/// Returns the style of an answer's unit: rad as mm/m, others as they are.
[[nodiscard]] IntervalStyle StyleOfUnit(const std::string& unit);

inline const IntervalStyle kSeconds{.unit = "s"};
inline const IntervalStyle kMilliseconds{.unit = "ms", .scale = 1000, .min_decimals = 1};
inline const IntervalStyle kPercent{.unit = "%", .scale = 100, .min_decimals = 1};
inline const IntervalStyle kMillimetres{.unit = "mm"};
inline const IntervalStyle kOffsetMillimetres{.unit = "mm", .signs = true};

}  // namespace trammel::report
