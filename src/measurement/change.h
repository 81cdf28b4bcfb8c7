// How a value changed since the last time, and when the next measurement is due.
#pragma once

#include <cstddef>
#include <span>
#include <string>
#include <vector>

#include "base/measured.h"
#include "measurement/outcome.h"

namespace trammel::measurement {

/// One quantity before and after.
struct Change {
  std::string name;
  std::string unit;
  Measured before;
  Measured after;
  Measured difference;      ///< after − before; not good where either is not
  std::size_t results = 1;  ///< that `before` is made of

  /// Whether the 95 % interval of the difference leaves out zero.
  [[nodiscard]] bool differs() const;
};

/// Compares the quantities that both results have under one name and unit, in the order of
/// `after`. The interval's halves are the root sum of squares of the results' own on each side
/// (Zou & Donner 2008), so that an interval aslant about its value stays aslant.
[[nodiscard]] std::vector<Change> Compare(const Outcome& before, const Outcome& after);

/// The fewest earlier results that show how much results of one thing scatter.
inline constexpr std::size_t kFewestForDrift = 3;

/// Compares a result with the mean of what earlier ones found. The interval is the wider of two:
/// what the stated uncertainties allow, and Student's prediction interval from the scatter of the
/// earlier values, which holds what no result could state (a spool's other end, another day).
/// Intervals of several quantities hold together with 95 % (Sidak 1967): of results where nothing
/// changed, at most one in twenty has any quantity that differs.
/// @param earlier  results of the same instrument, printer, nozzle and filament.
/// Leaves out quantities that are not good in `now`, or in fewer than kFewestForDrift earlier ones.
[[nodiscard]] std::vector<Change> Drift(std::span<const Outcome> earlier, const Outcome& now);

/// Whether two results are of the same instrument, printer, nozzle and filament, and of no other
/// toolhead or nozzle temperature as far as both note it. Two of which nothing is noted are not
/// known to be; nor are pressure advances of a filament without a name.
[[nodiscard]] bool SameSubject(const Outcome& a, const Outcome& b);

/// What the results of one thing say.
struct Series {
  std::string last_good_utc;  ///< empty: none gave an answer
  std::string last_reason;    ///< why the newest gave none; empty: it gave one
  bool changed = false;       ///< the newest answer differs from the earlier ones' mean
  bool applied = false;       ///< the newest answer was
  std::string nozzle_utc;     ///< when the printer's nozzle was changed since; empty: it was not
};

/// Returns the reasons to measure it anew; none: it need not be.
/// @param now_utc   ISO 8601 to the second, ending in Z, as the series' times
/// @param age_days  from which an answer is too old, (0, 36500]
[[nodiscard]] std::vector<std::string> ReasonsToMeasure(const Series& series,
                                                        const std::string& now_utc,
                                                        double age_days);

}  // namespace trammel::measurement
