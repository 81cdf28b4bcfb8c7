#include "tap/tuning/tuning_advice.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <numbers>

#include "tap/tuning/tuning_candidates.h"

namespace trammel::tap {
namespace {

constexpr double kNan = std::numeric_limits<double>::quiet_NaN();
constexpr double kUmPerMm = 1000;
constexpr double kFalseTrigger = 6;  // deviations: one in 5e8 samples

Advice AdviseDistance(const TrialSettings& present, const TrialSettings& advised, double depth) {
  Advice advice{"pull-back distance", "mm", present.pull_back_mm, advised.pull_back_mm, false, {}};
  advice.change = present.pull_back_mm != advised.pull_back_mm;
  advice.because = fmt::format(
      "{:.1f} times the press of {:.0f} µm; the way after the break fixes "
      "the baseline, beyond four times it only costs time",
      advised.pull_back_mm / depth, depth * kUmPerMm);
  return advice;
}

Advice AdviseSpeed(const TapTraits& traits, const TrialSettings& present,
                   const TrialSettings& advised, double depth) {
  Advice advice{"pull-back speed",
                "mm/s",
                present.pull_back_speed_mm_s,
                advised.pull_back_speed_mm_s,
                false,
                {}};
  advice.change = present.pull_back_speed_mm_s != advised.pull_back_speed_mm_s;
  advice.because = fmt::format(
      "{:.0f} samples in the press at {:.0f} samples/s and {:.2f} gf of noise; the pull-back takes "
      "{:.1f} s",
      depth / advised.pull_back_speed_mm_s * traits.sample_rate_hz, traits.sample_rate_hz,
      traits.noise_g, advised.pull_back_mm / advised.pull_back_speed_mm_s);
  return advice;
}

Advice AdviseForce(const TapTraits& traits, const TrialSettings& present,
                   const TrialSettings& advised, double depth) {
  Advice advice{"press force", "gf", present.press_force_g, advised.press_force_g, false, {}};
  advice.change = present.press_force_g != advised.press_force_g;
  const double noise = kFalseTrigger * traits.approach_noise_g;
  if (advice.change) {
    advice.because = fmt::format(
        "set the trigger force {:+.0f} gf; the press gets {:.0f} µm deep ({:.0f} µm now)",
        advised.press_force_g - present.press_force_g, depth * kUmPerMm,
        traits.press_depth_mm * kUmPerMm);
  } else {
    advice.because = fmt::format("{:.0f} µm deep, with what the head overshoots", depth * kUmPerMm);
  }
  advice.because += fmt::format("; a trigger force below {:.0f} gf would fire by noise", noise);
  return advice;
}

/// @param depth  Of the press as advised; the collision's rise goes with it.
Advice AdviseDriftFilter(const TapTraits& traits, double force_g, double depth) {
  constexpr double kMostLost = 0.05;   // of the collision's force, until it triggers
  constexpr double kMostOffset = 0.1;  // of the press force, left by drift
  Advice advice{"drift filter", "Hz", kNan, kNan, false, {}};
  const double rise_s = depth / traits.approach_speed_mm_s;
  // A high-pass of first order lets 1 - w t / 2 of a ramp of length t through, and leaves s / w of
  // a slope s.
  const double highest = 2 * kMostLost / rise_s / (2 * std::numbers::pi);
  const double lowest = traits.drift_g_s / (kMostOffset * force_g) / (2 * std::numbers::pi);
  if (!std::isfinite(highest)) {
    advice.because = "the recordings hold no approach, so its speed is not known";
    return advice;
  }
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

/// Averaging helps against what differs from tap to tap.
Advice AdviseTaps(const AdviceFigures& figures) {
  constexpr double kMost = 10;
  Advice advice{"taps per point", "", kNan, kNan, false, {}};
  const double one = std::hypot(figures.uncertainty_mm, figures.machine_scatter_mm);
  const double taps = std::max(1.0, std::ceil(std::pow(one / figures.wanted_uncertainty_mm, 2)));
  const std::string machine = figures.machine_scatter_mm > 0
                                  ? fmt::format(", and the machine's own scatter {:.2f} µm",
                                                figures.machine_scatter_mm * kUmPerMm)
                                  : "";
  advice.because = fmt::format(
      "one tap's standard uncertainty is {:.2f} µm{}; {:.2g} µm are wanted",
      figures.uncertainty_mm * kUmPerMm, machine, figures.wanted_uncertainty_mm * kUmPerMm);
  if (taps > kMost) {
    advice.because += fmt::format(": more than {:.0f} taps, which no mesh has time for", kMost);
    return advice;
  }
  advice.advised = taps;
  return advice;
}

}  // namespace

std::vector<Advice> AdviceLines(const TrialWorld& world, const TapTraits& traits,
                                const TrialSettings& present, const TrialSettings& advised,
                                const AdviceFigures& figures) {
  const double depth = MedianDepth(world, advised.press_force_g);
  return {AdviseDistance(present, advised, depth), AdviseSpeed(traits, present, advised, depth),
          AdviseForce(traits, present, advised, depth),
          AdviseDriftFilter(traits, advised.press_force_g, depth), AdviseTaps(figures)};
}

}  // namespace trammel::tap
