// Advice on how to tap, from taps that were recorded.
#pragma once

#include <cstddef>
#include <cstdint>
#include <limits>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "tap/analyse/analyse.h"
#include "tap/ensemble/scatter.h"
#include "tap/samples/tap.h"
#include "tap/tuning/tuning_trial.h"

namespace trammel::tap {

/// A tap with what was found in it by the contact method. Neither is owned.
struct TuningTap {
  TapView tap;
  const TapAnalysis* analysis = nullptr;
  // Where they are known; only to explain scatter.
  double temperature_c = std::numeric_limits<double>::quiet_NaN();
  double x_mm = std::numeric_limits<double>::quiet_NaN();
  double y_mm = std::numeric_limits<double>::quiet_NaN();
};

struct TuningOptions {
  /// Standard uncertainty that one tap shall have, mm; > 0. A first layer does not show 1 um.
  double wanted_uncertainty_mm = 0.001;
  TapOptions analysis;     ///< With which the taps were analysed; its method is the contact one.
  std::uint64_t seed = 1;  ///< Of the trial.
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
  double noise_g = 0;               ///< Of one sample of the free nozzle on the pull-back.
  double approach_noise_g = 0;      ///< Before the collision.
  double drift_g_s = 0;             ///< Size of the force's slope where nothing touches.
  double claimed_uncertainty_mm = 0;
};

/// What one number is and should be, with the figures behind it.
struct Advice {
  std::string what;  ///< "pull-back distance"
  std::string unit;
  double present = 0;   ///< NaN where the recordings do not tell.
  double advised = 0;   ///< The present one where it stays; NaN where no value would do.
  bool change = false;  ///< Whether the difference is worth the trouble.
  std::string because;
};

enum class TuningEnd : std::uint8_t {
  kChange,  ///< Change what the advice says.
  kKeep,    ///< The present settings do what is wanted, or none is better: `because`.
  kNone,    ///< No advice can be given: `because`.
};

/// "change", "keep" or "none", as written to JSON.
[[nodiscard]] std::string_view ToString(TuningEnd end);

struct Tuning {
  TuningEnd end = TuningEnd::kNone;
  std::string because;  ///< In a sentence or two, whatever the end.
  std::size_t recorded = 0;
  std::size_t recorded_good = 0;
  std::size_t recorded_shallow = 0;  ///< Of the good ones, with the notice short_press.
  TapTraits traits;                  ///< With `taps` 0 and all else 0 where too few taps are good.
  double predicted_uncertainty_mm = 0;  ///< By BreakUncertainty, for the taps as they are.
  std::vector<Advice> advice;           ///< Empty where there is none.
  Scatter scatter;
  // Of one trial; neither where none could be made.
  std::optional<TrialOutcome> trial_present;
  std::optional<TrialOutcome> trial_advised;  ///< Only where something is to be changed.
  std::size_t tried = 0;                      ///< Sets of settings.
};

/// Standard uncertainty of the break point in mm, for a press that is fitted with its curvature on
/// a sloped baseline: s/k sqrt(h (9/L + 4/B)), where s is the noise of a sample, k the stiffness,
/// h = speed / rate the way between samples, L the depth of the press and B the way after the
/// break. (The variance at the end of a straight line through n samples is 4 s^2/n, of a parabola 9
/// s^2/n.) It leaves out that the order of the press may be wrong.
[[nodiscard]] double BreakUncertainty(const TapTraits& traits, double speed_mm_s, double press_mm,
                                      double after_mm);

/// Chooses settings together and tries them on taps drawn from these (tuning_search.h). Advice to
/// change something is given only if 95 % of such taps are good and no less certain than under the
/// present settings; else the present ones stay, and `because` says why.
/// @param taps  Of one printer under one setting, in the order of time; any may be bad.
[[nodiscard]] Tuning Tune(std::span<const TuningTap> taps, const TuningOptions& options = {});

}  // namespace trammel::tap
