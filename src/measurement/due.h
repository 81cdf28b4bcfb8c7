// Whether something is to be measured anew: by the age of its last answer, and by what came after.
#pragma once

#include <optional>
#include <string>
#include <string_view>
#include <vector>

namespace trammel::measurement {

enum class Need { kNone, kSoon, kDue };

/// As JSON has it: "none", "soon", "due".
[[nodiscard]] std::string_view ToString(Need need);

struct DueRules {
  double age_days = 90;  ///< of the last answer, (0, 36500]
  double soon = 0.8;     ///< of age_days, (0, 1]: from there on it is due soon
};

/// What the results of one thing say.
struct Series {
  std::string last_good_utc;  ///< empty: none gave an answer
  std::string last_reason;    ///< why the newest gave none; empty: it gave one
  bool changed = false;       ///< the newest answer differs from the earlier ones' mean
  bool creeps = false;        ///< the answers creep since the last one that was applied
  bool applied = false;       ///< the newest answer was
  std::string nozzle_utc;     ///< when the printer's nozzle was changed since; empty: it was not
};

struct Due {
  Need need = Need::kNone;
  std::vector<std::string> reasons;  ///< of the need, the worst first
};

/// @param now_utc  ISO 8601 to the second, ending in Z, as the series' times.
[[nodiscard]] Due JudgeDue(const Series& series, const std::string& now_utc, const DueRules& rules);

/// Days from one time to another; absent where either is no ISO 8601 to the second, ending in Z.
[[nodiscard]] std::optional<double> DaysBetween(const std::string& from_utc,
                                                const std::string& to_utc);

}  // namespace trammel::measurement
