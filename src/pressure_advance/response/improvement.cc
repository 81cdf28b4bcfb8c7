#include "pressure_advance/response/improvement.h"

#include <fmt/format.h>

#include <cmath>
#include <set>
#include <string>

#include "base/check.h"
#include "base/statistics.h"
#include "pressure_advance/response/excess.h"

namespace trammel::pressure_advance {
namespace {

// One figure of every usable line, by kind.
struct Samples {
  std::vector<double> control;
  std::vector<double> calibrated;
};

std::optional<Measured> RefuseTooFew(const Samples& samples, const ImprovementOptions& options,
                                     const std::string& why) {
  const auto enough = [&](const std::vector<double>& sample) {
    return static_cast<int>(sample.size()) >= options.fewest_lines;
  };
  if (enough(samples.control) && enough(samples.calibrated)) return std::nullopt;
  return Measured::Refused(fmt::format(
      "{} control and {} calibrated lines could be measured, at least {} of each are needed{}",
      samples.control.size(), samples.calibrated.size(), options.fewest_lines, why));
}

// sign * (calibrated / control) + offset, from the means.
Measured Ratio(const Samples& samples, double offset, double sign,
               const ImprovementOptions& options) {
  const double control = Mean(samples.control);
  const double ratio = Mean(samples.calibrated) / control;
  const auto part = [&](const std::vector<double>& sample, double weight) {
    const double of_mean =
        StandardDeviation(sample) / std::sqrt(static_cast<double>(sample.size()));
    return std::pow(weight * of_mean / control, 2);
  };
  const double from_calibrated = part(samples.calibrated, 1);
  const double from_control = part(samples.control, ratio);
  const double variance = from_calibrated + from_control;
  double half = 0;
  if (variance > 0) {
    // Welch and Satterthwaite.
    const auto over = [](double v, const std::vector<double>& sample) {
      return v * v / static_cast<double>(sample.size() - 1);
    };
    const double freedom =
        variance * variance /
        (over(from_calibrated, samples.calibrated) + over(from_control, samples.control));
    half = StudentT95(freedom) * std::sqrt(variance);
  }
  const double value = offset + sign * ratio;
  if (half > options.widest_interval) {
    return Measured::CannotTell(
        fmt::format("{:.0f} % is known to {:.0f} % to either side (95 %), {:.0f} % are allowed: "
                    "the lines differ "
                    "too much among themselves; print more of them",
                    100 * value, 100 * half, 100 * options.widest_interval));
  }
  return Measured::Good({value, std::sqrt(variance), {value - half, value + half}});
}

Measured Left(const Samples& samples, const ImprovementOptions& options, const std::string& why) {
  if (auto refused = RefuseTooFew(samples, options, why)) return *refused;
  const double mean = Mean(samples.control);
  const double error =
      StandardDeviation(samples.control) / std::sqrt(static_cast<double>(samples.control.size()));
  if (mean < options.least_significance * error) {
    return Measured::CannotTell(fmt::format(
        "the control's surplus filament is only {:.1f} times its standard error, {} are needed",
        error > 0 ? mean / error : 0.0, options.least_significance));
  }
  return Ratio(samples, 0, 1, options);
}

Improvement RefuseAll(Improvement improvement, const std::string& reason) {
  improvement.deviation = Measured::Refused(reason);
  improvement.acceleration_left = improvement.deviation;
  improvement.deceleration_left = improvement.deviation;
  return improvement;
}

void CompareSurplus(const std::vector<LineProfile>& profiles, const LineMotion& motion,
                    const ImprovementOptions& options, const std::string& why,
                    Improvement& improvement) {
  const auto reading = ChooseReading(profiles);
  const auto plan = PlanTransitions(motion, profiles.front().position_unit,
                                    improvement.calibrated.pressure_advance_s, options.transitions);
  if (!reading || !plan) {
    const std::string reason = reading ? plan.error().message : "no line could be measured" + why;
    improvement.acceleration_left = Measured::Refused(reason);
    improvement.deceleration_left = improvement.acceleration_left;
    return;
  }
  const std::vector<LineExcess> excess = MeasureExcess(profiles, *reading, *plan);
  Samples acceleration;
  Samples deceleration;
  for (std::size_t i = 0; i < profiles.size(); ++i) {
    if (!excess[i].unusable.empty()) continue;
    const bool control = profiles[i].pressure_advance_s == improvement.control.pressure_advance_s;
    (control ? acceleration.control : acceleration.calibrated)
        .push_back(excess[i].acceleration.value);
    (control ? deceleration.control : deceleration.calibrated)
        .push_back(excess[i].deceleration.value);
  }
  improvement.acceleration_left = Left(acceleration, options, why);
  improvement.deceleration_left = Left(deceleration, options, why);
}

}  // namespace

Improvement CompareWithControl(const std::vector<LineProfile>& profiles,
                               std::span<const std::optional<double>> score_px,
                               const LineMotion& motion, const ImprovementOptions& options) {
  TRAMMEL_CHECK(profiles.size() == score_px.size(), "{} profiles, {} scores", profiles.size(),
                score_px.size());
  Improvement improvement;
  std::set<double> values;
  std::string why;
  for (const LineProfile& profile : profiles) {
    values.insert(profile.pressure_advance_s);
    if (why.empty() && !profile.unusable.empty()) {
      why = fmt::format("; a line at {:.4g} s: {}", profile.pressure_advance_s, profile.unusable);
    }
  }
  if (values.size() != 2) {
    return RefuseAll(improvement,
                     fmt::format("the lines have {} different values of pressure advance; a "
                                 "comparison has two, the control's and the calibrated one",
                                 values.size()));
  }
  improvement.control.pressure_advance_s = *values.begin();
  improvement.calibrated.pressure_advance_s = *values.rbegin();
  Samples scores;
  for (std::size_t i = 0; i < profiles.size(); ++i) {
    const bool is_control = profiles[i].pressure_advance_s == *values.begin();
    ComparedGroup& group = is_control ? improvement.control : improvement.calibrated;
    ++group.lines;
    if (!profiles[i].unusable.empty() || !score_px[i]) continue;
    ++group.used;
    (is_control ? scores.control : scores.calibrated).push_back(*score_px[i]);
  }
  if (!scores.control.empty()) improvement.control.deviation_px = Mean(scores.control);
  if (!scores.calibrated.empty()) improvement.calibrated.deviation_px = Mean(scores.calibrated);
  if (auto refused = RefuseTooFew(scores, options, why)) {
    improvement.deviation = *refused;
  } else if (Mean(scores.control) > 0) {
    improvement.deviation = Ratio(scores, 1, -1, options);
  } else {
    improvement.deviation = Measured::CannotTell("the control's lines do not deviate at all");
  }
  CompareSurplus(profiles, motion, options, why, improvement);
  return improvement;
}

}  // namespace trammel::pressure_advance
