// Why something is to be measured anew: by the age of its last answer, and by what came after.
#pragma once

#include <string>
#include <vector>

namespace trammel::measurement {

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
