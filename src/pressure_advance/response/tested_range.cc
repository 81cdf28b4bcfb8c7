#include "pressure_advance/response/tested_range.h"

#include <fmt/format.h>

#include <algorithm>

#include "base/check.h"

namespace trammel::pressure_advance {
namespace {

RangedAnswer Outside(const std::string& why, double about_s, const Interval& tested_s) {
  const Interval next = PrintNext(about_s, tested_s);
  return {Measured::CannotTell(
              fmt::format("{}: print a pattern from {:.3g} to {:.3g} s", why, next.lo, next.hi)),
          next};
}

}  // namespace

Interval RangeOf(std::span<const double> pressure_advance_s) {
  TRAMMEL_CHECK(!pressure_advance_s.empty(), "no values");
  const auto [lo, hi] = std::minmax_element(pressure_advance_s.begin(), pressure_advance_s.end());
  return {*lo, *hi};
}

Interval PrintNext(double about_s, const Interval& tested_s) {
  const double beyond = std::max({0.0, tested_s.lo - about_s, about_s - tested_s.hi});
  const double half = (tested_s.hi - tested_s.lo) / 2 + beyond;
  const double lo = std::max(0.0, about_s - half);
  return {lo, std::max(about_s + half, lo + half)};
}

RangedAnswer JudgeInRange(double value_s, double standard_uncertainty_s, double half_width95_s,
                          const Interval& tested_s, double widest, const std::string& too_wide) {
  const Interval interval{value_s - half_width95_s, value_s + half_width95_s};
  const double range = tested_s.hi - tested_s.lo;
  const bool wide = !(half_width95_s <= widest * range);
  const bool inside = value_s >= tested_s.lo && value_s <= tested_s.hi;
  if (wide && inside) return {Measured::CannotTell(too_wide), std::nullopt};
  const auto past = [&](const char* side, bool surely) {
    return fmt::format(
        "the answer {} {} the tested range {:.4g} to {:.4g} s (about {:.3g} s, 95 % "
        "interval {:.3g} to {:.3g} s)",
        surely ? "lies" : "may lie", side, tested_s.lo, tested_s.hi, value_s, interval.lo,
        interval.hi);
  };
  if (interval.hi > tested_s.hi) {
    return Outside(past("above", interval.lo > tested_s.hi), value_s, tested_s);
  }
  if (tested_s.lo > 0 && interval.lo < tested_s.lo) {
    return Outside(past("below", interval.hi < tested_s.lo), value_s, tested_s);
  }
  if (interval.hi < 0) {
    return {Measured::CannotTell(fmt::format(
                "the lines ask for a pressure advance below 0 (95 % interval {:.3g} to {:.3g} s), "
                "and no extruder leads: are the values in order, and is the side at which printing "
                "began right?",
                interval.lo, interval.hi)),
            std::nullopt};
  }
  if (wide) return {Measured::CannotTell(too_wide), std::nullopt};
  // An interval cut off at 0 says no less than its uncertainty: half of it stays >= one u.
  const double value = std::max(0.0, value_s);
  const double lo = std::max(0.0, interval.lo);
  const double hi = std::max(interval.hi, lo + 2 * standard_uncertainty_s);
  return {Measured::Good({value, standard_uncertainty_s, {lo, hi}}), std::nullopt};
}

}  // namespace trammel::pressure_advance
