#include "measurement/due.h"

#include <fmt/format.h>

#include <ctime>
#include <optional>

namespace trammel::measurement {
namespace {

std::optional<std::time_t> ParseUtc(const std::string& text) {
  std::tm time{};
  const char* const end = strptime(text.c_str(), "%Y-%m-%dT%H:%M:%SZ", &time);
  if (end == nullptr || *end != '\0') return std::nullopt;
  return timegm(&time);
}

/// Why the age of an answer is one; empty: it is young enough.
std::string AgeReason(const std::string& last_utc, const std::string& now_utc, double age_days) {
  constexpr double kClockSlack_days = 1;
  constexpr double kDay_s = 86400;
  const auto last = ParseUtc(last_utc);
  const auto now = ParseUtc(now_utc);
  if (!last || !now) {
    return fmt::format("its age is not known: its last answer is of '{}'", last_utc);
  }
  const double days = std::difftime(*now, *last) / kDay_s;
  if (days < -kClockSlack_days) {
    return fmt::format(
        "its last answer is of {}, which is to come: the clock of a computer is wrong", last_utc);
  }
  if (days < age_days) return {};
  return fmt::format("its last answer is {:.0f} days old, of {:g}", days, age_days);
}

}  // namespace

std::vector<std::string> ReasonsToMeasure(const Series& series, const std::string& now_utc,
                                          double age_days) {
  if (series.last_good_utc.empty()) {
    return {"no answer yet" + (series.last_reason.empty() ? "" : ": " + series.last_reason)};
  }
  std::vector<std::string> reasons;
  if (std::string age = AgeReason(series.last_good_utc, now_utc, age_days); !age.empty()) {
    reasons.push_back(std::move(age));
  }
  if (!series.nozzle_utc.empty()) {
    reasons.push_back("the nozzle was changed since: " + series.nozzle_utc);
  }
  if (series.changed && !series.applied) {
    reasons.emplace_back("its last answer differs from the earlier ones and was not applied");
  }
  if (!series.last_reason.empty()) {
    reasons.push_back("its last measurement gave no answer: " + series.last_reason);
  }
  return reasons;
}

}  // namespace trammel::measurement
