// Change of a value since the last measurement, and the time of the next one.
#pragma once

#include <cstddef>
#include <ctime>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "base/measured.h"
#include "measurement/outcome.h"

namespace trammel::measurement {

/// Quantity before and after.
struct Change {
  std::string name;
  std::string unit;
  Measured before;
  Measured after;
  Measured difference;      ///< after − before; not good where either is not
  std::size_t results = 1;  ///< number combined in `before`

  /// True if the 95 % interval of the difference excludes zero.
  [[nodiscard]] bool differs() const;
};

/// Compares the quantities of both results with equal name and unit, in the order of `after`. Each
/// half of the interval is the root sum of squares of the results' own on that side (Zou & Donner
/// 2008), so that asymmetric intervals remain asymmetric.
[[nodiscard]] std::vector<Change> Compare(const Outcome& before, const Outcome& after);

/// Minimum number of earlier results to estimate their scatter.
inline constexpr std::size_t kFewestForDrift = 3;

/// Compares a result with the mean of earlier ones. The interval is the wider of two: that of the
/// stated uncertainties, and Student's prediction interval from the scatter of the earlier values.
/// The latter includes effects that no result can state (a spool's other end, another day).
/// Intervals of several quantities hold jointly with 95 % (Sidak 1967): without a change, at most
/// one result in twenty has any quantity that differs.
/// @param earlier  results of the same instrument, printer, nozzle and filament.
/// Omits quantities that are not good in `now`, or in fewer than kFewestForDrift earlier ones.
[[nodiscard]] std::vector<Change> Drift(std::span<const Outcome> earlier, const Outcome& now);

/// True if two results have the same instrument, printer, nozzle and filament, and do not differ in
/// toolhead or nozzle temperature if both note them. False if nothing is noted of both, and for
/// pressure advances of an unnamed filament.
[[nodiscard]] bool SameSubject(const Outcome& a, const Outcome& b);

/// Returns the seconds since 1970 of a provenance's time; absent if it is none.
[[nodiscard]] std::optional<std::time_t> ParseUtc(const std::string& text);

/// Summary of one subject's results.
struct Series {
  std::string last_good_utc;  ///< empty: none gave an answer
  std::string last_reason;    ///< why the newest has no value; empty: it has one
  bool changed = false;       ///< the newest answer differs from the earlier ones' mean
  bool applied = false;       ///< the newest answer was
  std::string nozzle_utc;     ///< time of the printer's latest nozzle change; empty: none
};

/// Returns the reasons to repeat a measurement; empty: none.
/// @param now_utc   ISO 8601 to the second, ending in Z, as the series' times
/// @param age_days  from which an answer is too old, (0, 36500]
[[nodiscard]] std::vector<std::string> ReasonsToMeasure(const Series& series,
                                                        const std::string& now_utc,
                                                        double age_days);

}  // namespace trammel::measurement
