#include "measurement/due.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <charconv>
#include <chrono>
#include <cstddef>

namespace trammel::measurement {
namespace {

constexpr std::array<std::string_view, 3> kNeeds{"none", "soon", "due"};

/// Digits only, and all of `text`.
std::optional<int> Digits(std::string_view text) {
  int number = 0;
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), number);
  const bool all = error == std::errc() && end == text.data() + text.size();
  return all && text.front() != '-' ? std::optional(number) : std::nullopt;
}

std::optional<std::chrono::sys_seconds> ParseUtc(std::string_view text) {
  constexpr std::string_view kForm = "0000-00-00T00:00:00Z";
  if (text.size() != kForm.size()) return std::nullopt;
  for (std::size_t i = 0; i < kForm.size(); ++i) {
    if (kForm[i] != '0' && text[i] != kForm[i]) return std::nullopt;
  }
  const auto year = Digits(text.substr(0, 4));
  const auto month = Digits(text.substr(5, 2));
  const auto day = Digits(text.substr(8, 2));
  const auto hour = Digits(text.substr(11, 2));
  const auto minute = Digits(text.substr(14, 2));
  const auto second = Digits(text.substr(17, 2));
  if (!year || !month || !day || !hour || !minute || !second) return std::nullopt;
  const std::chrono::year_month_day date{std::chrono::year(*year),
                                         std::chrono::month(static_cast<unsigned>(*month)),
                                         std::chrono::day(static_cast<unsigned>(*day))};
  if (!date.ok() || *hour > 23 || *minute > 59 || *second > 60) return std::nullopt;
  return std::chrono::sys_days(date) + std::chrono::hours(*hour) + std::chrono::minutes(*minute) +
         std::chrono::seconds(*second);
}

/// Collects reasons, the worst first.
class Judgement {
 public:
  void Add(Need need, std::string reason) {
    const auto at = need == Need::kDue ? soon_ : due_.reasons.size();
    due_.reasons.insert(due_.reasons.begin() + static_cast<std::ptrdiff_t>(at), std::move(reason));
    soon_ += need == Need::kDue ? 1 : 0;
    due_.need = std::max(due_.need, need);
  }
  [[nodiscard]] Due Take() { return std::move(due_); }

 private:
  Due due_;
  std::size_t soon_ = 0;  // where the reasons of kSoon begin
};

}  // namespace

std::string_view ToString(Need need) { return kNeeds.at(static_cast<std::size_t>(need)); }

std::optional<double> DaysBetween(const std::string& from_utc, const std::string& to_utc) {
  const auto from = ParseUtc(from_utc);
  const auto to = ParseUtc(to_utc);
  if (!from || !to) return std::nullopt;
  return std::chrono::duration<double, std::ratio<86400>>(*to - *from).count();
}

Due JudgeDue(const Series& series, const std::string& now_utc, const DueRules& rules) {
  constexpr double kClockSlack_days = 1;
  Judgement judgement;
  if (series.last_good_utc.empty()) {
    judgement.Add(Need::kDue,
                  "no answer yet" + (series.last_reason.empty() ? "" : ": " + series.last_reason));
    return judgement.Take();
  }
  const auto days = DaysBetween(series.last_good_utc, now_utc);
  if (!days) {
    judgement.Add(Need::kSoon, fmt::format("its age is not known: its last answer is of '{}'",
                                           series.last_good_utc));
  } else if (*days < -kClockSlack_days) {
    judgement.Add(Need::kSoon,
                  fmt::format("its last answer is of {}, which is to come: the clock of a computer "
                              "is wrong",
                              series.last_good_utc));
  } else if (*days >= rules.soon * rules.age_days) {
    judgement.Add(
        *days >= rules.age_days ? Need::kDue : Need::kSoon,
        fmt::format("its last answer is {:.0f} days old, of {:g}", *days, rules.age_days));
  }
  if (!series.nozzle_utc.empty()) {
    judgement.Add(Need::kDue, "the nozzle was changed since: " + series.nozzle_utc);
  }
  if (series.creeps) {
    judgement.Add(Need::kDue, "its answers creep since the last one that was applied");
  }
  if (series.changed && !series.applied) {
    judgement.Add(Need::kDue, "its last answer differs from the earlier ones and was not applied");
  }
  if (!series.last_reason.empty()) {
    judgement.Add(Need::kSoon, "its last measurement gave no answer: " + series.last_reason);
  }
  return judgement.Take();
}

}  // namespace trammel::measurement
