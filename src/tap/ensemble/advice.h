// Advises how to tap better, by formula, from recorded taps of one setting.
#pragma once

#include <cstddef>
#include <span>
#include <string>
#include <vector>

#include "tap/ensemble/ensemble.h"
#include "tap/samples/tap.h"

namespace trammel::tap {

/// A tap with its analysis by the contact method. Neither is owned.
struct AdvisedTap {
  TapView tap;
  const TapAnalysis* analysis = nullptr;
};

/// What the taps are like: medians over the good ones.
struct TapTraits {
  double sample_rate_hz = 0;
  double approach_speed_mm_s = 0;  ///< NaN where no approach was recorded.
  double pull_back_speed_mm_s = 0;
  double pull_back_mm = 0;        ///< The whole way up.
  double acceleration_mm_s2 = 0;  ///< Of the pull-back's start; 0 where it starts at full speed.
  double press_depth_mm = 0;      ///< From the break down to the halt.
  double press_force_g = 0;       ///< At the start of the pull-back's cruise.
  double noise_g = 0;             ///< Of one sample.
  double approach_noise_g = 0;    ///< On the way down, before the touch; NaN where not recorded.
  double drift_g_s = 0;           ///< Size of the free nozzle's slope.
  double uncertainty_mm = 0;      ///< Standard uncertainty that a tap states.

  [[nodiscard]] double Stiffness() const { return press_force_g / press_depth_mm; }
};

/// One setting: what it is and should be, with the figures behind it.
struct Advice {
  std::string setting;  ///< "pull-back distance"
  std::string unit;
  double present = 0;  ///< NaN where the recordings do not show it.
  double advised = 0;  ///< The present one where it stays; NaN where no value would do.
  bool change = false;
  std::string because;
};

struct TapAdvice {
  std::string none;                    ///< Why there is no advice; else empty.
  TapTraits traits;                    ///< All 0 without a good tap.
  double uncertainty_by_noise_mm = 0;  ///< BreakUncertainty of the taps as they are.
  std::vector<Advice> settings;        ///< Force, distance, speed, drift filter, taps per point.
};

/// Standard uncertainty of the break for a press that is fitted with its curvature on a sloped
/// baseline: s/k sqrt(h (9/L + 4/B)), with the noise s of a sample, the stiffness k, the way h
/// between samples, the press depth L and the way B after the break. (The variance at the end of a
/// parabola through n samples is 9 s^2/n, of a line 4 s^2/n.)
[[nodiscard]] double BreakUncertainty(const TapTraits& traits, double speed_mm_s, double press_mm,
                                      double after_mm);

/// @param taps      In the order of time; any may be bad.
/// @param ensemble  Of the same taps.
/// @param wanted_mm Standard uncertainty that one tap shall have, > 0.
[[nodiscard]] TapAdvice Advise(std::span<const AdvisedTap> taps, const Ensemble& ensemble,
                               double wanted_mm);

}  // namespace trammel::tap
