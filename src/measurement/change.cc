#include "measurement/change.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <ctime>
#include <optional>
#include <utility>

#include "base/statistics.h"

namespace trammel::measurement {
namespace {

Measured Difference(const Measured& before, const Measured& after) {
  for (const auto& [side, which] : {std::pair{&before, "before"}, std::pair{&after, "after"}}) {
    if (!side->good()) {
      return Measured::CannotTell(fmt::format("the value {} is {}: {}", which,
                                              VerdictText(side->verdict()), side->reason()));
    }
  }
  const Quantity& a = before.quantity();
  const Quantity& b = after.quantity();
  const double value = b.value - a.value;
  const double below = std::hypot(b.value - b.interval95.lo, a.interval95.hi - a.value);
  const double above = std::hypot(b.interval95.hi - b.value, a.value - a.interval95.lo);
  return Measured::Good({value,
                         std::hypot(a.standard_uncertainty, b.standard_uncertainty),
                         {value - below, value + above}});
}

/// Returns the earlier results' good values with the name and unit of `answer`.
std::vector<Quantity> GoodOnes(std::span<const Outcome> earlier, const Answer& answer) {
  std::vector<Quantity> found;
  for (const Outcome& outcome : earlier) {
    const Answer* const one = outcome.Find(answer.name);
    if (one != nullptr && one->unit == answer.unit && one->value.good()) {
      found.push_back(one->value.quantity());
    }
  }
  return found;
}

}  // namespace

bool Change::differs() const {
  if (!difference.good()) return false;
  const Interval& interval = difference.quantity().interval95;
  return interval.lo > 0 || interval.hi < 0;
}

std::vector<Change> Compare(const Outcome& before, const Outcome& after) {
  std::vector<Change> changes;
  for (const Answer& answer : after.answers) {
    const Answer* const other = before.Find(answer.name);
    if (other == nullptr || other->unit != answer.unit) continue;
    changes.push_back({answer.name, answer.unit, other->value, answer.value,
                       Difference(other->value, answer.value)});
  }
  return changes;
}

namespace {

/// Compares a quantity of a result with its earlier values.
/// @param alpha  allowed rate of intervals that miss
Change AgainstMean(const Answer& now, const std::vector<Quantity>& earlier, double alpha) {
  constexpr double kNormalFreedom = 1e6;  // Student's t is normal from there on
  const auto count = static_cast<double>(earlier.size());
  std::vector<double> values;
  double stated = 0;  // variance of the mean, as stated
  for (const Quantity& quantity : earlier) {
    values.push_back(quantity.value);
    stated += quantity.standard_uncertainty * quantity.standard_uncertainty / (count * count);
  }
  const double mean = trammel::Mean(values);
  const double scatter = StandardDeviation(values);
  const double student = StudentPoint(alpha, count - 1);
  const double normal = StudentPoint(alpha, kNormalFreedom);
  const double mean_u = std::sqrt(std::max(stated, scatter * scatter / count));
  const double mean_half =
      std::max(normal * std::sqrt(stated), student * scatter / std::sqrt(count));

  const Quantity& present = now.value.quantity();
  const double widened = normal / kNormal95;
  const double predicted_u = scatter * std::sqrt(1 + 1 / count);
  const auto half = [&](double of_present) {
    return std::max(student * predicted_u, std::hypot(widened * of_present, mean_half));
  };
  const double difference = present.value - mean;
  const double u = std::max(std::hypot(present.standard_uncertainty, mean_u), predicted_u);
  const Interval interval{difference - half(present.value - present.interval95.lo),
                          difference + half(present.interval95.hi - present.value)};
  return {now.name,
          now.unit,
          Measured::Good({mean, mean_u, {mean - mean_half, mean + mean_half}}),
          now.value,
          Measured::Good({difference, u, interval}),
          earlier.size()};
}

}  // namespace

std::vector<Change> Drift(std::span<const Outcome> earlier, const Outcome& now) {
  constexpr double kConfidence = 0.95;
  std::vector<std::pair<const Answer*, std::vector<Quantity>>> compared;
  for (const Answer& answer : now.answers) {
    if (!answer.value.good()) continue;
    std::vector<Quantity> values = GoodOnes(earlier, answer);
    if (values.size() >= kFewestForDrift) compared.emplace_back(&answer, std::move(values));
  }
  std::vector<Change> changes;
  const double alpha = 1 - std::pow(kConfidence, 1 / static_cast<double>(compared.size()));
  for (const auto& [answer, values] : compared) {
    changes.push_back(AgainstMean(*answer, values, alpha));
  }
  return changes;
}

bool SameSubject(const Outcome& a, const Outcome& b) {
  const auto same = [&](std::string Subject::*text) { return a.subject.*text == b.subject.*text; };
  const auto may_be_same = [&](std::string Subject::*text) {
    return same(text) || (a.subject.*text).empty() || (b.subject.*text).empty();
  };
  const bool of_a_filament = a.provenance.instrument == Instrument::kPressureAdvance;
  return a.provenance.instrument == b.provenance.instrument && a.subject != Subject{} &&
         same(&Subject::printer) && same(&Subject::nozzle) && same(&Subject::filament) &&
         may_be_same(&Subject::toolhead) && may_be_same(&Subject::nozzle_c) &&
         !(of_a_filament && a.subject.filament.empty());
}

std::optional<std::time_t> ParseUtc(const std::string& text) {
  std::tm time{};
  const char* const end = strptime(text.c_str(), "%Y-%m-%dT%H:%M:%SZ", &time);
  if (end == nullptr || *end != '\0') return std::nullopt;
  return timegm(&time);
}

namespace {

/// Returns the reason to remeasure by age; empty: it is recent.
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
