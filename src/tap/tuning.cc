#include "tap/tuning.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>

#include "base/statistics.h"
#include "tap/finding.h"
#include "tap/motion.h"

namespace trammel::tap {
namespace {

constexpr double kNan = std::numeric_limits<double>::quiet_NaN();
constexpr double kUmPerMm = 1000;
/// Of the press, so that the samples in the break's neighbourhood decide it and not the model.
constexpr double kLeastPressSamples = 20;
/// Way after the break as a multiple of the press: there the baseline's part of the variance is
/// 2/11 of the whole, and going farther gains less than a tenth of the uncertainty.
constexpr double kAfterPerPress = 2;
/// A published check refuses breaks in the last quarter of the pull-back.
constexpr double kLatestBreak = 0.75;
/// Differences below this are not worth a change.
constexpr double kWorthwhile = 0.25;

/// One value per usable tap.
struct Collected {
  std::vector<double> rate, approach_speed, speed, way, acceleration, depth, force, noise,
      approach_noise, drift, uncertainty;
};

double FittedPress(const FittedForce& force, double depth_mm) {
  double value = 0;
  double power = depth_mm;
  for (const double coefficient : force.press_g) {
    value += coefficient * power;
    power *= depth_mm;
  }
  return value;
}

double SampleRate(const TapView& tap) {
  std::vector<double> steps;
  for (std::size_t i = 1; i < tap.time_s.size(); ++i) {
    const double step = tap.time_s[i] - tap.time_s[i - 1];
    if (step > 0) steps.push_back(step);
  }
  return steps.empty() ? kNan : 1 / Median(steps);
}

struct Flat {
  double noise_g = kNan;
  double slope_g_s = kNan;
};

/// The stretch before the collision: its slope, and the scatter about it.
Flat ReadApproach(const TapView& tap, const TapMotion& motion) {
  constexpr double kBeforeHalt_s = 0.1;
  constexpr std::size_t kLeast = 16;
  constexpr double kLeast_s = 0.25;  // in less, noise makes a slope
  std::vector<double> t;
  std::vector<double> f;
  for (std::size_t i = 0; motion.has_approach && i < tap.time_s.size(); ++i) {
    const bool flat = tap.time_s[i] >= motion.approach_start_s &&
                      tap.time_s[i] <= motion.approach_end_s - kBeforeHalt_s;
    if (!flat || !std::isfinite(tap.force_g[i])) continue;
    t.push_back(tap.time_s[i]);
    f.push_back(tap.force_g[i]);
  }
  if (t.size() < kLeast || t.back() - t.front() < kLeast_s) return {};
  const double mean_t = Mean(t);
  const double mean_f = Mean(f);
  double tt = 0;
  double tf = 0;
  for (std::size_t i = 0; i < t.size(); ++i) {
    tt += (t[i] - mean_t) * (t[i] - mean_t);
    tf += (t[i] - mean_t) * (f[i] - mean_f);
  }
  const double slope = tf / tt;
  for (std::size_t i = 0; i < t.size(); ++i) f[i] -= mean_f + slope * (t[i] - mean_t);
  return {RobustStandardDeviation(f), slope};
}

void Collect(const TuningTap& tuning_tap, Collected& all) {
  const TapAnalysis& analysis = *tuning_tap.analysis;
  TapMotion motion;
  if (analysis.verdict != Verdict::kGood || !analysis.force.fitted ||
      FindMotion(tuning_tap.tap.moves, motion).code != FindingCode::kNone) {
    return;
  }
  const double depth = analysis.force.break_z_mm - motion.halt_z_mm;
  const double force =
      std::abs(FittedPress(analysis.force, analysis.force.break_z_mm - motion.cruise_start_z_mm));
  if (!(depth > 0) || !(force > 0) || !(analysis.noise_g > 0)) return;
  const Flat flat = ReadApproach(tuning_tap.tap, motion);
  all.rate.push_back(SampleRate(tuning_tap.tap));
  all.speed.push_back(motion.pull_back_speed_mm_s);
  all.way.push_back(motion.end_z_mm - motion.halt_z_mm);
  all.acceleration.push_back(motion.acceleration_mm_s2);
  all.depth.push_back(depth);
  all.force.push_back(force);
  all.noise.push_back(analysis.noise_g);
  all.uncertainty.push_back(analysis.standard_uncertainty_mm);
  if (motion.has_approach) all.approach_speed.push_back(motion.approach_speed_mm_s);
  if (std::isfinite(flat.noise_g)) all.approach_noise.push_back(flat.noise_g);
  const double slope = std::isfinite(flat.slope_g_s)
                           ? flat.slope_g_s
                           : analysis.force.baseline_slope_g_mm * motion.pull_back_speed_mm_s;
  all.drift.push_back(std::abs(slope));
}

double MedianOrNan(const std::vector<double>& values) {
  return values.empty() ? kNan : Median(values);
}

TapTraits TraitsOf(const Collected& all) {
  TapTraits traits;
  traits.taps = all.rate.size();
  traits.sample_rate_hz = MedianOrNan(all.rate);
  traits.approach_speed_mm_s = MedianOrNan(all.approach_speed);
  traits.pull_back_speed_mm_s = MedianOrNan(all.speed);
  traits.pull_back_mm = MedianOrNan(all.way);
  traits.acceleration_mm_s2 = MedianOrNan(all.acceleration);
  traits.press_depth_mm = MedianOrNan(all.depth);
  traits.press_force_g = MedianOrNan(all.force);
  traits.stiffness_g_mm = traits.press_force_g / traits.press_depth_mm;
  traits.noise_g = MedianOrNan(all.noise);
  traits.approach_noise_g = MedianOrNan(all.approach_noise);
  traits.drift_g_s = MedianOrNan(all.drift);
  traits.claimed_uncertainty_mm = MedianOrNan(all.uncertainty);
  return traits;
}

bool WorthChanging(double present, double advised) {
  return std::isfinite(present) && std::abs(advised - present) > kWorthwhile * present;
}

Advice AdviseDistance(const TapTraits& traits) {
  const double press = traits.press_depth_mm;
  const double advised = std::max(press * (1 + kAfterPerPress), press / kLatestBreak);
  const double after = std::max(traits.pull_back_mm - press, press / 100);
  Advice advice{"pull-back distance", "mm", traits.pull_back_mm, advised, false, {}};
  // Farther than needed only costs time.
  advice.change = advised > advice.present * (1 + kWorthwhile) || advised < advice.present / 3;
  advice.because = fmt::format(
      "the press is {:.0f} µm deep, and twice that way after the break fixes the baseline: "
      "{:.2f} µm uncertainty where the present distance gives {:.2f} µm and an endless one {:.2f} "
      "µm",
      press * kUmPerMm,
      kUmPerMm * BreakUncertainty(traits, traits.pull_back_speed_mm_s, press, advised - press),
      kUmPerMm * BreakUncertainty(traits, traits.pull_back_speed_mm_s, press, after),
      kUmPerMm * BreakUncertainty(traits, traits.pull_back_speed_mm_s, press, 1e9));
  return advice;
}

Advice AdviseSpeed(const TapTraits& traits, double wanted_mm) {
  constexpr double kLongestRamp = 0.1;  // of the press: samples in it are dropped
  constexpr double kSlowest_mm_s = 0.05;
  const double press = traits.press_depth_mm;
  const double now =
      BreakUncertainty(traits, traits.pull_back_speed_mm_s, press, kAfterPerPress * press);
  const double by_noise = traits.pull_back_speed_mm_s * std::pow(wanted_mm / now, 2);
  const double by_samples = press * traits.sample_rate_hz / kLeastPressSamples;
  const double by_ramp = traits.acceleration_mm_s2 > 0
                             ? std::sqrt(2 * traits.acceleration_mm_s2 * kLongestRamp * press)
                             : std::numeric_limits<double>::infinity();
  const double fastest = std::min({by_noise, by_samples, by_ramp});
  Advice advice{"pull-back speed",
                "mm/s",
                traits.pull_back_speed_mm_s,
                std::max(fastest, kSlowest_mm_s),
                false,
                {}};
  advice.change = WorthChanging(advice.present, advice.advised);
  advice.because = fmt::format(
      "noise of {:.2f} gf at {:.0f} gf/mm and {:.0f} samples/s allows {:.2f} mm/s for {:.1f} µm, "
      "{:.0f} samples in the press {:.2f} mm/s, and a ramp over a tenth of the press {:.2f} mm/s",
      traits.noise_g, traits.stiffness_g_mm, traits.sample_rate_hz, by_noise, wanted_mm * kUmPerMm,
      kLeastPressSamples, by_samples, by_ramp);
  return advice;
}

Advice AdviseForce(const TapTraits& traits, double wanted_mm) {
  constexpr double kFalseTrigger = 6;  // deviations: one in 5e8 samples
  const double way_mm = traits.pull_back_speed_mm_s / traits.sample_rate_hz;
  const double unit = traits.noise_g / traits.stiffness_g_mm / wanted_mm;
  // u^2 = (s/k)^2 h (9 + 4 / kAfterPerPress) / L, solved for L.
  const double deep_enough = unit * unit * way_mm * (9 + 4 / kAfterPerPress);
  const double sampled = kLeastPressSamples * way_mm;
  const double needed = traits.stiffness_g_mm * std::max(deep_enough, sampled);
  const double noise =
      std::isfinite(traits.approach_noise_g) ? traits.approach_noise_g : traits.noise_g;
  Advice advice{"press force", "gf", traits.press_force_g, std::max(needed, kFalseTrigger * noise),
                false,         {}};
  // More force than needed does no harm to the measurement; less force spares bed and nozzle.
  advice.change =
      advice.advised > advice.present * (1 + kWorthwhile) || advice.advised < advice.present / 3;
  advice.because = fmt::format(
      "{:.1f} µm at the present speed needs a press of {:.0f} µm, {:.0f} gf, and {:.0f} gf are six "
      "times the approach's noise. The force reached is the trigger force and what the head "
      "overshoots: change the trigger force by the difference",
      wanted_mm * kUmPerMm, kUmPerMm * needed / traits.stiffness_g_mm, needed,
      kFalseTrigger * noise);
  return advice;
}

Advice AdviseDriftFilter(const TapTraits& traits) {
  constexpr double kMostLost = 0.05;   // of the collision's force, until it triggers
  constexpr double kMostOffset = 0.1;  // of the press force, left by drift
  Advice advice{"drift filter", "Hz", kNan, kNan, false, {}};
  const double rise_s = traits.press_force_g / (traits.stiffness_g_mm * traits.approach_speed_mm_s);
  // A high-pass of first order lets 1 - w t / 2 of a ramp of length t through, and leaves s / w of
  // a slope s.
  const double highest = 2 * kMostLost / rise_s / (2 * std::numbers::pi);
  const double lowest =
      traits.drift_g_s / (kMostOffset * traits.press_force_g) / (2 * std::numbers::pi);
  if (!std::isfinite(highest)) {
    advice.because = "the recordings hold no approach, so its speed is not known";
    return advice;
  }
  advice.because = fmt::format(
      "a drift of {:.2f} gf/s stays below a tenth of the press force above {:.3f} Hz, and a "
      "collision of {:.0f} ms passes with 95 % of its force below {:.2f} Hz",
      traits.drift_g_s, lowest, rise_s * 1000, highest);
  if (lowest > highest) {
    advice.because += ". No cut-off does both: approach faster, or find what drifts";
    return advice;
  }
  // Without drift any low cut-off would do; a hundredth of the highest follows minutes.
  advice.advised = std::sqrt(std::max(lowest, highest / 100) * highest);
  return advice;
}

}  // namespace

double BreakUncertainty(const TapTraits& traits, double speed_mm_s, double press_mm,
                        double after_mm) {
  const double way_mm = speed_mm_s / traits.sample_rate_hz;
  return traits.noise_g / traits.stiffness_g_mm * std::sqrt(way_mm * (9 / press_mm + 4 / after_mm));
}

std::optional<Tuning> Tune(std::span<const TuningTap> taps, const TuningOptions& options) {
  Collected all;
  for (const TuningTap& tap : taps) Collect(tap, all);
  if (all.rate.empty()) return std::nullopt;
  Tuning tuning;
  tuning.traits = TraitsOf(all);
  const TapTraits& traits = tuning.traits;
  const double after = std::max(traits.pull_back_mm - traits.press_depth_mm, 1e-6);
  tuning.predicted_uncertainty_mm =
      BreakUncertainty(traits, traits.pull_back_speed_mm_s, traits.press_depth_mm, after);
  tuning.advice = {AdviseDistance(traits), AdviseSpeed(traits, options.wanted_uncertainty_mm),
                   AdviseForce(traits, options.wanted_uncertainty_mm), AdviseDriftFilter(traits)};
  return tuning;
}

}  // namespace trammel::tap
