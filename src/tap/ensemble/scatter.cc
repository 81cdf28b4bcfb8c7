#include "tap/ensemble/scatter.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <vector>

#include "base/statistics.h"

namespace trammel::tap {
namespace {

constexpr std::size_t kLeastTaps = 5;
constexpr double kLeastExplained = 0.4;
constexpr double kNormal99 = 2.326348;  // one-sided
/// Of Student's two-sided 95 % point, roughly the 99 % one; from 5 degrees of freedom on no less.
constexpr double kTo99 = 1.57;
constexpr double kUmPerMm = 1000;

/// Heights and possible causes, each less its mean at the tap's place.
struct Pattern {
  std::vector<double> z_mm, time_s, temperature_c, force_g, turn;
  double freedom = 0;
};

void TakeMean(std::vector<double>& values, std::size_t first) {
  const double mean = Mean(std::span(values).subspan(first));
  for (std::size_t i = first; i < values.size(); ++i) values[i] -= mean;
}

bool SamePlace(const TapResult& tap, const Place& place) {
  constexpr double kSame_mm = 0.1;
  if (!std::isfinite(place.x_mm)) return !std::isfinite(tap.x_mm) || !std::isfinite(tap.y_mm);
  return std::hypot(tap.x_mm - place.x_mm, tap.y_mm - place.y_mm) <= kSame_mm;
}

Pattern PatternOf(std::span<const ScatteredTap> taps, const Ensemble& ensemble) {
  Pattern pattern;
  for (const Place& place : ensemble.places) {
    const std::size_t first = pattern.z_mm.size();
    double turn = 1;
    for (std::size_t i = 0; i < taps.size(); ++i) {
      const TapResult& tap = taps[i].result;
      const bool used = tap.good && SamePlace(tap, place) &&
                        !std::binary_search(ensemble.outliers.begin(), ensemble.outliers.end(), i);
      if (!used) continue;
      pattern.z_mm.push_back(tap.z_mm);
      pattern.time_s.push_back(tap.time_s);
      pattern.temperature_c.push_back(tap.temperature_c);
      pattern.force_g.push_back(taps[i].press_force_g);
      pattern.turn.push_back(turn);
      turn = -turn;
    }
    const std::size_t count = pattern.z_mm.size() - first;
    if (count == 0) continue;
    pattern.freedom += static_cast<double>(count) - 1;
    for (std::vector<double>* values : {&pattern.z_mm, &pattern.time_s, &pattern.temperature_c,
                                        &pattern.force_g, &pattern.turn}) {
      TakeMean(*values, first);
    }
  }
  return pattern;
}

/// Share of the heights' variance that goes with x; 0 where chance may have made it.
double Explained(const Pattern& pattern, const std::vector<double>& x) {
  double xx = 0;
  double xz = 0;
  double zz = 0;
  for (std::size_t i = 0; i < x.size(); ++i) {
    xx += x[i] * x[i];
    xz += x[i] * pattern.z_mm[i];
    zz += pattern.z_mm[i] * pattern.z_mm[i];
  }
  const double freedom = pattern.freedom - 1;
  if (!(xx > 0) || !(zz > 0) || !(freedom >= 3)) return 0;  // NaN where a figure is not known
  const double share = std::min(xz * xz / (xx * zz), 1.0);
  const double t = std::sqrt(freedom * share / std::max(1 - share, 1e-12));
  return t > kTo99 * StudentT95(freedom) ? share : 0;
}

/// Correlation of neighbours, 0 where chance may have made it.
double Wander(const Pattern& pattern) {
  double products = 0;
  double squares = 0;
  const std::size_t n = pattern.z_mm.size();
  for (std::size_t i = 0; i < n; ++i) {
    squares += pattern.z_mm[i] * pattern.z_mm[i];
    if (i > 0) products += pattern.z_mm[i] * pattern.z_mm[i - 1];
  }
  const double correlation = squares > 0 ? products / squares : 0;
  return correlation > kNormal99 / std::sqrt(static_cast<double>(n)) ? correlation : 0;
}

/// The chi-squared figure of `freedom` that chance exceeds once in a hundred (Wilson & Hilferty).
double RareChiSquared(double freedom) {
  const double ninth = 2 / (9 * freedom);
  return freedom * std::pow(1 - ninth + kNormal99 * std::sqrt(ninth), 3);
}

std::string_view WhatToDo(ScatterCause cause) {
  switch (cause) {
    case ScatterCause::kTemperature:
      return "Heights go with the nozzle's temperature: let it settle before tapping, or tap at "
             "one "
             "temperature.";
    case ScatterCause::kTime:
      return "Heights run in one direction: bed, frame or nozzle still warm up or creep. Heat "
             "longer "
             "before tapping.";
    case ScatterCause::kAlternating:
      return "Every other tap is higher: two states that take turns, as lost motion in Z or a step "
             "of "
             "the motor. Approach each tap the same way.";
    case ScatterCause::kPressForce:
      return "Heights go with the force of the press: it is of another form than the fit's, or the "
             "bed gives way. Make the force the same: approach more slowly, fasten sheet and bed.";
    case ScatterCause::kWander:
      return "Neighbouring taps lie together: something wanders slowly (temperature, cable, "
             "filament). Heat longer, relieve cable and filament.";
    case ScatterCause::kBacklash:
      return "No pattern in time, and the drive does not follow at the start of the pull-back: "
             "backlash or sticking in Z.";
    default:
      return "No pattern: the machine does not come back to one height (backlash, steps of the "
             "motor, plastic on the nozzle). Slower taps do not mend that.";
  }
}

ScatterCause CauseOf(std::span<const ScatteredTap> taps, const Ensemble& ensemble,
                     double& explained) {
  const Pattern pattern = PatternOf(taps, ensemble);
  ScatterCause cause = ScatterCause::kMachine;
  // In this order: what comes first goes before what explains no more than it.
  constexpr double kMore = 0.05;
  for (const auto& [candidate, values] :
       {std::pair{ScatterCause::kTemperature, &pattern.temperature_c},
        std::pair{ScatterCause::kTime, &pattern.time_s},
        std::pair{ScatterCause::kAlternating, &pattern.turn},
        std::pair{ScatterCause::kPressForce, &pattern.force_g}}) {
    const double share = Explained(pattern, *values);
    if (share < kLeastExplained || share < explained + (explained > 0 ? kMore : 0)) continue;
    explained = share;
    cause = candidate;
  }
  if (cause != ScatterCause::kMachine) return cause;
  if (Wander(pattern) > 0) return ScatterCause::kWander;
  const auto trimmed = std::count_if(taps.begin(), taps.end(),
                                     [](const ScatteredTap& tap) { return tap.press_trimmed; });
  return 2 * static_cast<std::size_t>(trimmed) > taps.size() ? ScatterCause::kBacklash : cause;
}

}  // namespace

std::string_view ToString(ScatterCause cause) {
  switch (cause) {
    case ScatterCause::kTooFew:
      return "too_few";
    case ScatterCause::kNoise:
      return "noise";
    case ScatterCause::kTemperature:
      return "temperature";
    case ScatterCause::kTime:
      return "time";
    case ScatterCause::kAlternating:
      return "alternating";
    case ScatterCause::kPressForce:
      return "press_force";
    case ScatterCause::kWander:
      return "wander";
    case ScatterCause::kBacklash:
      return "backlash";
    case ScatterCause::kMachine:
      return "machine";
  }
  return "machine";
}

Scatter ExplainScatter(std::span<const ScatteredTap> taps) {
  std::vector<TapResult> results;
  for (const ScatteredTap& tap : taps) results.push_back(tap.result);
  const Ensemble ensemble = Summarise(results);
  Scatter scatter;
  scatter.taps = ensemble.used;
  scatter.outliers = ensemble.outliers.size();
  const double freedom =
      static_cast<double>(ensemble.used) - static_cast<double>(ensemble.places.size());
  if (ensemble.used < kLeastTaps || freedom < 4) {
    scatter.because = fmt::format(
        "{} good tap{} at {} place{} cannot tell scatter from noise: record ten at one place",
        ensemble.used, ensemble.used == 1 ? "" : "s", ensemble.places.size(),
        ensemble.places.size() == 1 ? "" : "s");
    return scatter;
  }
  const double claimed = ensemble.predicted_deviation_mm;
  const double deviation = ensemble.standard_deviation_mm;
  scatter.deviation_mm = deviation;
  scatter.claimed_mm = claimed;
  const std::string figures = fmt::format(
      "heights scatter by {:.2f} µm (standard deviation of {} taps) where their own "
      "uncertainties promise {:.2f} µm",
      deviation * kUmPerMm, ensemble.used, claimed * kUmPerMm);
  if (freedom * deviation * deviation <= RareChiSquared(freedom) * claimed * claimed) {
    scatter.cause = ScatterCause::kNoise;
    scatter.because = figures + ": nothing beyond noise shows";
    return scatter;
  }
  scatter.beyond_mm = std::sqrt(deviation * deviation - claimed * claimed);
  scatter.cause = CauseOf(taps, ensemble, scatter.explained);
  scatter.because = fmt::format("{}. {}", figures, WhatToDo(scatter.cause));
  return scatter;
}

}  // namespace trammel::tap
