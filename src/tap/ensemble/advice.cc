#include "tap/ensemble/advice.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <map>
#include <numbers>

#include "base/statistics.h"
#include "tap/samples/finding.h"
#include "tap/samples/motion.h"

namespace trammel::tap {
namespace {

constexpr double kNan = std::numeric_limits<double>::quiet_NaN();
constexpr double kUmPerMm = 1000;
constexpr double kMinDepth_mm = 0.0215;  // short_press at 20 um, with what a depth is measured to
constexpr double kMaxForce_g = 300;      // Klipper bounds the trigger's force by 250 gf
constexpr double kSlowest_mm_s = 0.03;
constexpr double kLongest_s = 3;      // a pull-back, in which every drift counts
constexpr double kPressSamples = 24;  // so that they decide the press and not its model
constexpr double kLongestRamp = 0.1;  // of the press: samples in the ramp are left out
constexpr double kFalseTrigger = 6;   // deviations: one in 5e8 samples

double MedianRate(const TapView& tap) {
  std::vector<double> steps;
  for (std::size_t i = 1; i < tap.time_s.size(); ++i) {
    const double step = tap.time_s[i] - tap.time_s[i - 1];
    if (step > 0) steps.push_back(step);
  }
  return steps.empty() ? kNan : 1 / Median(steps);
}

/// Estimates the noise from differences of neighbours, which contain no drift.
double ApproachNoise(const TapView& tap, const TapMotion& motion, double depth_mm) {
  constexpr double kMinBeforeHalt_s = 0.05;
  constexpr double kTouchDepth = 2;  // in press depths: plastic touches before the bed does
  constexpr std::size_t kMin = 8;
  if (!motion.has_approach) return kNan;
  const double until_s =
      motion.approach_end_s -
      std::max(kMinBeforeHalt_s, kTouchDepth * depth_mm / motion.approach_speed_mm_s);
  std::vector<double> steps;
  for (std::size_t i = 1; i < tap.time_s.size() && tap.time_s[i] <= until_s; ++i) {
    const double step = tap.force_g[i] - tap.force_g[i - 1];
    if (tap.time_s[i - 1] >= motion.approach_start_s && std::isfinite(step)) steps.push_back(step);
  }
  return steps.size() < kMin ? kNan : RobustStandardDeviation(steps) / std::numbers::sqrt2;
}

/// Returns the traits of a good tap whose moves contain a motion.
TapTraits TraitsOf(const AdvisedTap& tap, const TapMotion& motion) {
  const FittedForce& force = tap.analysis->force;
  TapTraits traits;
  traits.sample_rate_hz = MedianRate(tap.tap);
  traits.approach_speed_mm_s = motion.has_approach ? motion.approach_speed_mm_s : kNan;
  traits.pull_back_speed_mm_s = motion.pull_back_speed_mm_s;
  traits.pull_back_mm = motion.end_z_mm - motion.halt_z_mm;
  traits.acceleration_mm_s2 = motion.acceleration_mm_s2;
  traits.press_depth_mm = force.break_z_mm - motion.halt_z_mm;
  double power = 1;
  for (const double coefficient : force.press_g) {
    power *= force.break_z_mm - motion.cruise_start_z_mm;
    traits.press_force_g += coefficient * power;
  }
  traits.press_force_g = std::abs(traits.press_force_g);
  traits.noise_g = tap.analysis->noise_g;
  traits.approach_noise_g = ApproachNoise(tap.tap, motion, traits.press_depth_mm);
  traits.drift_g_s = force.baseline_slope_g_mm * motion.pull_back_speed_mm_s;
  traits.uncertainty_mm = tap.analysis->contact_mm.standard_uncertainty;
  return traits;
}

double MedianOf(const std::vector<TapTraits>& taps, double TapTraits::*member) {
  std::vector<double> values;
  for (const TapTraits& tap : taps) {
    if (std::isfinite(tap.*member)) values.push_back(tap.*member);
  }
  return values.empty() ? kNan : Median(values);
}

TapTraits Medians(const std::vector<TapTraits>& taps) {
  TapTraits medians;
  for (double TapTraits::*member :
       {&TapTraits::sample_rate_hz, &TapTraits::approach_speed_mm_s,
        &TapTraits::pull_back_speed_mm_s, &TapTraits::pull_back_mm, &TapTraits::acceleration_mm_s2,
        &TapTraits::press_depth_mm, &TapTraits::press_force_g, &TapTraits::noise_g,
        &TapTraits::approach_noise_g, &TapTraits::drift_g_s, &TapTraits::uncertainty_mm}) {
    medians.*member = MedianOf(taps, member);
  }
  medians.drift_g_s = std::abs(medians.drift_g_s);  // of signed values: noise has no slope
  return medians;
}

/// Names the setting that differs between taps; empty if all agree.
std::string MixedIn(const std::vector<TapTraits>& taps) {
  constexpr double kSame = 1.1;  // sample rates of one converter wander by some per cent
  for (const auto& [name, unit, member] :
       {std::tuple{"pull-back speeds", "mm/s", &TapTraits::pull_back_speed_mm_s},
        std::tuple{"pull-back distances", "mm", &TapTraits::pull_back_mm},
        std::tuple{"approach speeds", "mm/s", &TapTraits::approach_speed_mm_s},
        std::tuple{"sample rates", "samples/s", &TapTraits::sample_rate_hz}}) {
    const auto [least, most] = std::minmax_element(
        taps.begin(), taps.end(),
        [m = member](const TapTraits& a, const TapTraits& b) { return a.*m < b.*m; });
    if ((*most).*member > kSame * (*least).*member) {
      return fmt::format("{} from {:.3g} to {:.3g} {}", name, (*least).*member, (*most).*member,
                         unit);
    }
  }
  return {};
}

/// Returns the most frequent reason of the taps that are not good.
Finding MainReason(std::span<const AdvisedTap> taps) {
  std::map<FindingCode, std::size_t> counts;
  Finding main;
  std::size_t most = 0;
  for (const AdvisedTap& tap : taps) {
    if (tap.analysis->verdict == Verdict::kGood) continue;
    const std::size_t count = ++counts[tap.analysis->reason.code];
    if (count > most) main = tap.analysis->reason;
    most = std::max(most, count);
  }
  return main;
}

/// Settings: press depth, pull-back distance and its speed.
struct Settings {
  double depth_mm = 0;
  double pull_back_mm = 0;
  double speed_mm_s = 0;
};

/// Rounds down to two digits, for easy typing.
double Rounded(double value) {
  const double unit = std::pow(10, std::floor(std::log10(value)) - 1);
  return unit * std::floor(value / unit + 1e-6);
}

/// @param by_noise_mm  Of the wanted uncertainty, what noise alone may leave.
Settings SettingsFor(const TapTraits& traits, double depth_mm, double by_noise_mm) {
  constexpr double kPresses[] = {3, 4, 6};  // the least, the advised and the most way back
  constexpr double kStep_mm = 0.01;
  Settings settings{depth_mm, traits.pull_back_mm, traits.pull_back_speed_mm_s};
  if (traits.pull_back_mm < kPresses[0] * depth_mm ||
      traits.pull_back_mm > kPresses[2] * depth_mm) {
    settings.pull_back_mm = kStep_mm * std::ceil(kPresses[1] * depth_mm / kStep_mm);
  }
  double fastest = depth_mm * traits.sample_rate_hz / kPressSamples;
  if (traits.acceleration_mm_s2 > 0) {
    fastest = std::min(fastest, std::sqrt(2 * traits.acceleration_mm_s2 * kLongestRamp * depth_mm));
  }
  const double at_one = BreakUncertainty(traits, 1, depth_mm, settings.pull_back_mm - depth_mm);
  const double by_noise = std::pow(by_noise_mm / at_one, 2);
  const double slowest = std::max(kSlowest_mm_s, settings.pull_back_mm / kLongest_s);
  // Slower if that makes taps more certain; faster only if a pull-back takes too long.
  constexpr double kClose = 0.9;  // rounded speeds stay within 10 %
  const double present = traits.pull_back_speed_mm_s;
  const double most = std::max(std::min(by_noise, fastest), slowest);
  if (kClose * present > most) settings.speed_mm_s = Rounded(most);
  if (present < kClose * slowest) settings.speed_mm_s = Rounded(slowest);
  return settings;
}

Settings ChooseSettings(const TapTraits& traits, double by_noise_mm) {
  const double min_mm = std::max(traits.press_depth_mm, kMinDepth_mm);
  const Settings least = SettingsFor(traits, min_mm, by_noise_mm);
  for (const double deeper : {1.0, 1.4, 2.0, 3.0}) {
    const double depth_mm = deeper * min_mm;
    if (deeper > 1 && traits.Stiffness() * depth_mm > kMaxForce_g) break;
    const Settings settings = SettingsFor(traits, depth_mm, by_noise_mm);
    const double reached =
        BreakUncertainty(traits, settings.speed_mm_s, depth_mm, settings.pull_back_mm - depth_mm);
    if (reached <= 1.05 * by_noise_mm) return settings;  // speeds are rounded and stay within 10 %
  }
  return least;
}

Advice AdviseForce(const TapTraits& traits, double depth_mm) {
  Advice advice{"press force", "gf", traits.press_force_g, traits.press_force_g, false, {}};
  if (depth_mm > traits.press_depth_mm) {
    advice.advised = std::ceil(traits.Stiffness() * depth_mm);
    advice.change = true;
    advice.because = fmt::format(
        "set the trigger force {:+.0f} gf; the press gets {:.0f} µm deep ({:.0f} µm now)",
        advice.advised - advice.present, depth_mm * kUmPerMm, traits.press_depth_mm * kUmPerMm);
  } else {
    advice.because = fmt::format("{:.0f} µm deep", depth_mm * kUmPerMm);
  }
  if (std::isfinite(traits.approach_noise_g)) {
    advice.because += fmt::format("; a trigger force below {:.0f} gf would fire by noise",
                                  kFalseTrigger * traits.approach_noise_g);
  }
  return advice;
}

Advice AdviseDistance(const TapTraits& traits, const Settings& settings) {
  return {"pull-back distance",
          "mm",
          traits.pull_back_mm,
          settings.pull_back_mm,
          settings.pull_back_mm != traits.pull_back_mm,
          fmt::format("{:.1f} times the press of {:.0f} µm; the way after the break fixes the "
                      "baseline, beyond four times it only costs time",
                      settings.pull_back_mm / settings.depth_mm, settings.depth_mm * kUmPerMm)};
}

Advice AdviseSpeed(const TapTraits& traits, const Settings& settings) {
  return {
      "pull-back speed",
      "mm/s",
      traits.pull_back_speed_mm_s,
      settings.speed_mm_s,
      settings.speed_mm_s != traits.pull_back_speed_mm_s,
      fmt::format("{:.0f} samples in the press; noise of {:.2f} gf leaves {:.2f} µm; the "
                  "pull-back takes {:.1f} s",
                  settings.depth_mm / settings.speed_mm_s * traits.sample_rate_hz, traits.noise_g,
                  kUmPerMm * BreakUncertainty(traits, settings.speed_mm_s, settings.depth_mm,
                                              settings.pull_back_mm - settings.depth_mm),
                  settings.pull_back_mm / settings.speed_mm_s)};
}

/// Advises a filter. A high-pass of first order passes 1 - w t / 2 of a ramp of length t, and
/// leaves s / w of a slope s.
Advice AdviseDriftFilter(const TapTraits& traits, double depth_mm) {
  constexpr double kMaxLost = 0.05;   // of the collision force, until it triggers
  constexpr double kMaxOffset = 0.1;  // of the press force, left by drift
  Advice advice{"drift filter", "Hz", kNan, kNan, false, {}};
  if (!std::isfinite(traits.approach_speed_mm_s)) {
    advice.because = "the recordings hold no approach, so its speed is not known";
    return advice;
  }
  const double rise_s = depth_mm / traits.approach_speed_mm_s;
  const double highest = 2 * kMaxLost / rise_s / (2 * std::numbers::pi);
  const double lowest =
      traits.drift_g_s / (kMaxOffset * traits.Stiffness() * depth_mm) / (2 * std::numbers::pi);
  advice.because = fmt::format(
      "above {:.3f} Hz a drift of {:.2f} gf/s stays below a tenth of the press force, and below "
      "{:.2f} Hz a collision of {:.0f} ms keeps 95 % of its force",
      lowest, traits.drift_g_s, highest, rise_s * 1000);
  if (lowest > highest) {
    advice.because += ". No cut-off does both: approach faster, or find what drifts";
    return advice;
  }
  // Without drift any low cut-off would do; a hundredth of the highest follows minutes.
  advice.advised = std::sqrt(std::max(lowest, highest / 100) * highest);
  return advice;
}

/// Computes the heights' scatter beyond the taps' stated uncertainty; 0 if chance causes it once in
/// a hundred series.
double MachineScatter(const Ensemble& ensemble) {
  const int freedom = static_cast<int>(ensemble.used) - static_cast<int>(ensemble.places.size());
  const double claimed = ensemble.predicted_deviation_mm;
  const double ratio = std::pow(ensemble.standard_deviation_mm / claimed, 2);
  if (freedom < 4 || !(freedom * ratio > ChiSquareQuantile(0.99, freedom))) return 0;
  return claimed * std::sqrt(ratio - 1);
}

Advice AdviseTaps(double one_mm, double machine_mm, double wanted_mm) {
  constexpr double kMax = 10;
  Advice advice{"taps per point", "", kNan, kNan, false, {}};
  const double taps =
      std::max(1.0, std::ceil(std::pow(std::hypot(one_mm, machine_mm) / wanted_mm, 2)));
  advice.because = fmt::format("one tap's standard uncertainty is {:.2f} µm", one_mm * kUmPerMm);
  if (machine_mm > 0) {
    advice.because +=
        fmt::format(", and the machine's own scatter {:.2f} µm", machine_mm * kUmPerMm);
  }
  advice.because += fmt::format("; {:.2g} µm are wanted", wanted_mm * kUmPerMm);
  if (taps > kMax) {
    advice.because += fmt::format(": more than {:.0f} taps, which no mesh has time for", kMax);
  } else {
    advice.advised = taps;
  }
  return advice;
}

}  // namespace

double BreakUncertainty(const TapTraits& traits, double speed_mm_s, double press_mm,
                        double after_mm) {
  const double way_mm = speed_mm_s / traits.sample_rate_hz;
  return traits.noise_g / traits.Stiffness() * std::sqrt(way_mm * (9 / press_mm + 4 / after_mm));
}

TapAdvice Advise(std::span<const AdvisedTap> taps, const Ensemble& ensemble, double wanted_mm) {
  TapAdvice advice;
  std::vector<TapTraits> good;
  for (const AdvisedTap& tap : taps) {
    TapMotion motion;
    const bool usable = tap.analysis->verdict == Verdict::kGood && tap.analysis->force.fitted &&
                        FindMotion(tap.tap.moves, motion).code == FindingCode::kNone;
    if (usable) good.push_back(TraitsOf(tap, motion));
  }
  if (good.empty() || 4 * good.size() < taps.size()) {
    // A few good taps among many failures are lucky and not representative.
    advice.none = taps.empty() ? "there are no taps"
                               : fmt::format("{} of {} taps are good. {}", good.size(), taps.size(),
                                             Explain(MainReason(taps)));
    return advice;
  }
  const TapTraits& traits = advice.traits = Medians(good);
  advice.uncertainty_by_noise_mm =
      BreakUncertainty(traits, traits.pull_back_speed_mm_s, traits.press_depth_mm,
                       traits.pull_back_mm - traits.press_depth_mm);
  if (const std::string mixed = MixedIn(good); !mixed.empty()) {
    advice.none = fmt::format("these taps were made with {}: give those of one setting", mixed);
    return advice;
  }
  // A tap states more than noise alone causes: the form of its press is uncertain.
  const double more = std::max(1.0, traits.uncertainty_mm / advice.uncertainty_by_noise_mm);
  const Settings settings = ChooseSettings(traits, wanted_mm / more);
  const double one_mm = more * BreakUncertainty(traits, settings.speed_mm_s, settings.depth_mm,
                                                settings.pull_back_mm - settings.depth_mm);
  advice.settings = {AdviseForce(traits, settings.depth_mm), AdviseDistance(traits, settings),
                     AdviseSpeed(traits, settings), AdviseDriftFilter(traits, settings.depth_mm),
                     AdviseTaps(one_mm, MachineScatter(ensemble), wanted_mm)};
  return advice;
}

}  // namespace trammel::tap
