// Advises on better taps, by formula, from recorded taps of one setting.
#pragma once

#include <cstddef>
#include <span>
#include <string>
#include <vector>

#include "tap/ensemble/ensemble.h"
#include "tap/samples/tap.h"

namespace trammel::tap {

/// Tap with its analysis by the contact method. Neither is owned.
struct AdvisedTap {
  TapView tap;
  const TapAnalysis* analysis = nullptr;
};

/// Traits of the taps: medians over the good ones.
struct TapTraits {
  double sample_rate_hz = 0;
  double approach_speed_mm_s = 0;  ///< NaN where no approach was recorded.
  double pull_back_speed_mm_s = 0;
  double pull_back_mm = 0;        ///< The whole way up.
  double acceleration_mm_s2 = 0;  ///< at the pull-back's start; 0: starts at full speed
  double press_depth_mm = 0;      ///< break to halt
  double press_force_g = 0;       ///< at the start of the pull-back's cruise
  double noise_g = 0;             ///< per sample
  double approach_noise_g = 0;    ///< during the descent, before the touch; NaN if not recorded
  double drift_g_s = 0;           ///< Size of the free nozzle's slope.
  double uncertainty_mm = 0;      ///< Standard uncertainty that a tap states.

  [[nodiscard]] double Stiffness() const { return press_force_g / press_depth_mm; }
};

/// Advice on one setting: its present and its best value, with the figures behind it.
struct Advice {
  std::string setting;  ///< "pull-back distance"
  std::string unit;
  double present = 0;  ///< NaN where the recordings do not show it.
  double advised = 0;  ///< The present one where it stays; NaN where no value would do.
  bool change = false;
  std::string because;
};

struct TapAdvice {
  std::string none;                    ///< why there is no advice; else empty
  TapTraits traits;                    ///< All 0 without a good tap.
  double uncertainty_by_noise_mm = 0;  ///< BreakUncertainty of the taps as they are.
  std::vector<Advice> settings;        ///< Force, distance, speed, drift filter, taps per point.
};

/// Computes the standard uncertainty of the break for a press that is fitted with its curvature on
/// a sloped baseline: s/k sqrt(h (9/L + 4/B)), with the noise s of a sample, the stiffness k, the
/// way h between samples, the press depth L and the way B after the break. (The variance at the end
/// of a parabola through n samples is 9 s^2/n, of a line 4 s^2/n.)
[[nodiscard]] double BreakUncertainty(const TapTraits& traits, double speed_mm_s, double press_mm,
                                      double after_mm);

/// @param taps      In the order of time; any may be bad.
/// @param ensemble  Of the same taps.
/// @param wanted_mm Standard uncertainty that one tap shall have, > 0.
[[nodiscard]] TapAdvice Advise(std::span<const AdvisedTap> taps, const Ensemble& ensemble,
                               double wanted_mm);

}  // namespace trammel::tap
