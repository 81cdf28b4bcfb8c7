#include "measurement/change.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <utility>

#include "base/statistics.h"
#include "base/student.h"

namespace trammel::measurement {
namespace {

Measured Difference(const Measured& before, const Measured& after) {
  for (const auto& [side, which] : {std::pair{&before, "before"}, std::pair{&after, "after"}}) {
    if (!side->good()) {
      return Measured::CannotTell(fmt::format("the value {} is {}: {}", which,
                                              VerdictWords(side->verdict()), side->reason()));
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

/// The good values that earlier results have under the name and unit of `answer`.
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

std::vector<Change> Drift(std::span<const Outcome> earlier, const Outcome& now) {
  std::vector<Change> changes;
  for (const Answer& answer : now.answers) {
    if (!answer.value.good()) continue;
    const std::vector<Quantity> values = GoodOnes(earlier, answer);
    if (values.size() < kFewestForDrift) continue;
    const auto count = static_cast<double>(values.size());
    std::vector<double> centres;
    double stated = 0;  // variance of the mean, as stated
    for (const Quantity& quantity : values) {
      centres.push_back(quantity.value);
      stated += quantity.standard_uncertainty * quantity.standard_uncertainty / (count * count);
    }
    const double mean = trammel::Mean(centres);
    const double scatter = StandardDeviation(centres);
    const double student = StudentT95(count - 1);
    const double mean_u = std::sqrt(std::max(stated, scatter * scatter / count));
    const double mean_half =
        std::max(kNormal95 * std::sqrt(stated), student * scatter / std::sqrt(count));

    const Quantity& present = answer.value.quantity();
    const double difference = present.value - mean;
    const double predicted = student * scatter * std::sqrt(1 + 1 / count);
    const double below =
        std::max(predicted, std::hypot(present.value - present.interval95.lo, mean_half));
    const double above =
        std::max(predicted, std::hypot(present.interval95.hi - present.value, mean_half));
    const double u = std::max(std::hypot(present.standard_uncertainty, mean_u),
                              scatter * std::sqrt(1 + 1 / count));
    changes.push_back(
        {answer.name, answer.unit,
         Measured::Good({mean, mean_u, {mean - mean_half, mean + mean_half}}), answer.value,
         Measured::Good({difference, u, {difference - below, difference + above}}), values.size()});
  }
  return changes;
}

bool AnyDiffers(std::span<const Change> changes) {
  constexpr double kConfidence = 0.95;
  const double each = 1 - std::pow(kConfidence, 1 / static_cast<double>(changes.size()));
  return std::ranges::any_of(changes, [each](const Change& change) {
    if (!change.differs()) return false;
    const double freedom = std::max<double>(1, static_cast<double>(change.results) - 1);
    const Quantity& difference = change.difference.quantity();
    const Interval& interval = difference.interval95;
    const double towards_zero =
        difference.value > 0 ? difference.value - interval.lo : interval.hi - difference.value;
    const double t = StudentT95(freedom) * difference.value / towards_zero;
    return StudentTail(t, freedom) <= each;
  });
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

}  // namespace trammel::measurement
