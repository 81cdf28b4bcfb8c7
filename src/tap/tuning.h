// Advice on how to tap, from taps that were recorded.
#pragma once

#include <cstddef>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "tap/tap.h"

namespace trammel::tap {

/// A tap with what was found in it. Neither is owned.
struct TuningTap {
  TapView tap;
  const TapAnalysis* analysis = nullptr;
};

struct TuningOptions {
  /// Standard uncertainty that one tap shall have, mm; > 0. A first layer does not show 1 um.
  double wanted_uncertainty_mm = 0.001;
};

/// What the taps are like: medians over the good ones.
struct TapTraits {
  std::size_t taps = 0;  ///< That could be used.
  double sample_rate_hz = 0;
  double approach_speed_mm_s = 0;   ///< NaN where no move says it.
  double pull_back_speed_mm_s = 0;  ///< Of the cruise.
  double pull_back_mm = 0;          ///< The whole way up.
  double acceleration_mm_s2 = 0;    ///< Of the pull-back's start; 0 where it starts at once.
  double press_depth_mm = 0;        ///< From the break down to the halt.
  double press_force_g = 0;         ///< At the start of the pull-back's cruise.
  double stiffness_g_mm = 0;        ///< Press force by depth.
  double noise_g = 0;               ///< Of one sample during the pull-back.
  double approach_noise_g = 0;      ///< Before the collision; NaN where not recorded.
  double drift_g_s = 0;             ///< Size of the force's slope where nothing touches.
  double claimed_uncertainty_mm = 0;
};

/// What one number is and should be, with the figures behind it.
struct Advice {
  std::string what;  ///< "pull-back distance"
  std::string unit;
  double present = 0;   ///< NaN where the recordings do not tell.
  double advised = 0;   ///< NaN where no value would do.
  bool change = false;  ///< Whether the difference is worth the trouble.
  std::string because;
};

struct Tuning {
  TapTraits traits;
  double predicted_uncertainty_mm = 0;  ///< By BreakUncertainty, for the taps as they are.
  std::vector<Advice> advice;
};

/// Standard uncertainty of the break point in mm, for a press that is fitted with its curvature on
/// a sloped baseline: s/k sqrt(h (9/L + 4/B)), where s is the noise of a sample, k the stiffness,
/// h = speed / rate the way between samples, L the depth of the press and B the way after the
/// break. (The variance at the end of a straight line through n samples is 4 s^2/n, of a parabola 9
/// s^2/n.) It leaves out that the order of the press may be wrong.
[[nodiscard]] double BreakUncertainty(const TapTraits& traits, double speed_mm_s, double press_mm,
                                      double after_mm);

/// @returns nothing where no tap is good or none has a fitted press.
[[nodiscard]] std::optional<Tuning> Tune(std::span<const TuningTap> taps,
                                         const TuningOptions& options = {});

}  // namespace trammel::tap
