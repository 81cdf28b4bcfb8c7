#include "pressure_advance/response/improvement.h"

#include <fmt/format.h>

#include <cmath>
#include <set>
#include <string>

#include "base/check.h"
#include "base/statistics.h"
#include "pressure_advance/response/surplus.h"
#include "pressure_advance/response/transitions.h"

namespace trammel::pressure_advance {
namespace {

constexpr std::size_t kFewestLines = 3;  // per group, for a scatter
constexpr double kWidestInterval = 0.3;  // half width: wider does not distinguish much from little
constexpr double kMinSignificance = 5;   // control's surplus over its standard error

// One figure of every usable line, by group.
struct Samples {
  std::vector<double> control;
  std::vector<double> calibrated;
};

std::optional<Measured> RefuseTooFew(const Samples& samples, const std::string& why) {
  if (samples.control.size() >= kFewestLines && samples.calibrated.size() >= kFewestLines) {
    return std::nullopt;
  }
  return Measured::Refused(fmt::format(
      "{} control and {} calibrated lines could be measured, at least {} of each are needed{}",
      samples.control.size(), samples.calibrated.size(), kFewestLines, why));
}

// Returns sign * (calibrated / control) + offset, from the means.
Measured Ratio(const Samples& samples, double offset, double sign) {
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
  if (half > kWidestInterval) {
    return Measured::CannotTell(
        fmt::format("{:.0f} % is known to {:.0f} % to either side (95 %), {:.0f} % are allowed: "
                    "the lines differ too much among themselves",
                    100 * value, 100 * half, 100 * kWidestInterval));
  }
  return Measured::Good({value, std::sqrt(variance), {value - half, value + half}});
}

Measured DeviationLess(const Samples& scores, const std::string& why) {
  if (auto refused = RefuseTooFew(scores, why)) return *refused;
  if (Mean(scores.control) > 0) return Ratio(scores, 1, -1);
  return Measured::CannotTell("the control's lines do not deviate at all");
}

Measured SurplusLeft(const std::vector<LineProfile>& profiles, const LineMotion& motion,
                     const Improvement& improvement, const std::string& why) {
  const auto reading = ChooseReading(profiles);
  if (!reading) return Measured::Refused("no line could be measured" + why);
  const auto plan = PlanTransitions(motion, profiles.front().position_unit,
                                    improvement.calibrated.pressure_advance_s, {});
  if (!plan) return Measured::Refused(plan.error().message);
  const std::vector<LineSurplus> surplus = MeasureSurplus(profiles, *reading, *plan);
  Samples samples;
  for (std::size_t i = 0; i < profiles.size(); ++i) {
    if (!surplus[i].unusable.empty()) continue;
    const bool control = profiles[i].pressure_advance_s == improvement.control.pressure_advance_s;
    (control ? samples.control : samples.calibrated)
        .push_back((surplus[i].acceleration.value + surplus[i].deceleration.value) / 2);
  }
  if (auto refused = RefuseTooFew(samples, why)) return *refused;
  const double mean = Mean(samples.control);
  const double error =
      StandardDeviation(samples.control) / std::sqrt(static_cast<double>(samples.control.size()));
  if (mean < kMinSignificance * error) {
    return Measured::CannotTell(fmt::format(
        "the control's surplus filament is only {:.1f} times its standard error, {} are needed",
        error > 0 ? mean / error : 0.0, kMinSignificance));
  }
  return Ratio(samples, 0, 1);
}

}  // namespace

Improvement CompareWithControl(const std::vector<LineProfile>& profiles,
                               std::span<const std::optional<double>> score_px,
                               const LineMotion& motion) {
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
    improvement.deviation = improvement.surplus_left = Measured::Refused(
        fmt::format("the lines have {} different values of pressure advance; a comparison has two, "
                    "the control's and the calibrated one",
                    values.size()));
    return improvement;
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
  improvement.deviation = DeviationLess(scores, why);
  improvement.surplus_left = SurplusLeft(profiles, motion, improvement, why);
  return improvement;
}

}  // namespace trammel::pressure_advance
