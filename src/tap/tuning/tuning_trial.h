// Taps as they would be under other settings, drawn from recorded ones and analysed as real ones
// are: advice is tried before it is given.
#pragma once

#include <cstddef>
#include <cstdint>
#include <limits>
#include <map>
#include <span>
#include <vector>

#include "base/random.h"
#include "tap/analyse/analyse.h"
#include "tap/ensemble/noise_model.h"
#include "tap/samples/finding.h"
#include "tap/tuning/tap_template.h"

namespace trammel::tap {

/// What the recordings show, taps and noise.
struct TrialWorld {
  std::vector<TapTemplate> templates;  ///< At least one.
  NoiseModel noise;
  double latency_s = 0;  ///< Of the cell, one for all taps.
  /// Beyond what the templates say, halts scatter by up to so much to either side: where the next
  /// sample finds the trigger's force.
  double halt_scatter_mm = 0;
};

/// The settings on trial; the rest stays as recorded.
struct TrialSettings {
  double press_force_g = 0;  ///< Median at the start of the pull-back.
  double pull_back_speed_mm_s = 0;
  double pull_back_mm = 0;
};

struct DrawnTap {
  std::vector<double> time_s;
  std::vector<double> force_g;
  std::vector<Move> moves;
  double contact_z_mm = 0;

  [[nodiscard]] TapView View() const { return {time_s, force_g, moves}; }
};

/// Draws one tap from a random template: its press law at the depth that the force asks for, its
/// drift, step, loss at rest and pull, the model's noise, the recorded intervals between samples;
/// contact height and phases at random.
[[nodiscard]] DrawnTap DrawTap(const TrialWorld& world, const TrialSettings& settings,
                               Random& random);

struct TrialOutcome {
  std::size_t taps = 0;
  std::size_t good = 0;
  std::size_t shallow = 0;  ///< Of the good ones, with the notice short_press.
  // Of the good taps; NaN without any.
  double uncertainty_mm = std::numeric_limits<double>::quiet_NaN();  ///< Median, k = 1.
  double half_width_mm =
      std::numeric_limits<double>::quiet_NaN();  ///< Median, of the 95 % intervals.
  /// Of the contact's error, which a trial knows: what 68 % stay below.
  double error_mm = std::numeric_limits<double>::quiet_NaN();
  std::map<FindingCode, std::size_t> reasons;  ///< Why the others are not good.

  [[nodiscard]] double GoodShare() const {
    return taps > 0 ? static_cast<double>(good) / static_cast<double>(taps) : 0;
  }
  /// The lower end of the one-sided 95 % interval of the share (Wilson 1927): 196 of 200, or 60 of
  /// 60, show 95 %.
  [[nodiscard]] double ShownShare() const;
  /// The most frequent reason; kNone without any.
  [[nodiscard]] FindingCode MainReason() const;
};

/// Analyses `taps` taps drawn under the settings. The same seed draws the same worlds whatever the
/// settings, so that two trials compare.
[[nodiscard]] TrialOutcome RunTrial(const TrialWorld& world, const TrialSettings& settings,
                                    const TapOptions& options, std::size_t taps,
                                    std::uint64_t seed);

/// Samples of one tap under the settings: the cost of a trial.
[[nodiscard]] double SamplesOfTap(const TrialWorld& world, const TrialSettings& settings);

}  // namespace trammel::tap
