// What one recorded tap is like, in parts that other settings leave alone: the press, the drift,
// what was lost at rest. Taps under other settings are drawn from it (tuning_trial.h).
#pragma once

#include <array>
#include <cstddef>
#include <optional>
#include <vector>

#include "tap/ensemble/noise_model.h"
#include "tap/samples/tap.h"

namespace trammel::tap {

/// Force of the press against depth, as measured while the nozzle was pulled back: the fitted
/// polynomial, and what the samples show beside it where noise alone does not.
struct MeasuredPress {
  struct Knot {
    double depth_mm = 0;
    double rest_g = 0;
  };
  double depth_mm = 0;               ///< Of the deepest sample; beyond it a straight line.
  std::array<double, 4> smooth_g{};  ///< As FittedForce::press_g, positive for a press.
  std::vector<Knot> knots;           ///< By rising depth; the rest is straight between them.

  [[nodiscard]] double Force(double depth_mm) const;
  /// The least depth that has the force; searched to `most` times the measured depth.
  [[nodiscard]] double Depth(double force_g, double most) const;
};

/// How a tap is made, as far as its moves say.
struct TapSetting {
  double approach_speed_mm_s = 0;  ///< NaN where no move says it.
  double pull_back_speed_mm_s = 0;
  double pull_back_mm = 0;
  double acceleration_mm_s2 = 0;  ///< Of the pull-back; 0 where it starts at full speed.
  double sample_rate_hz = 0;
};

struct TapTemplate {
  MeasuredPress press;
  double press_force_g = 0;   ///< At the start of the pull-back's cruise.
  double press_depth_mm = 0;  ///< From the break down to the halt.
  double sign = 1;            ///< Of the force that a press adds.
  double tare_g = 0;          ///< The free nozzle's force at the break.
  TapSetting setting;
  double before_s = 0;   ///< Recorded before the halt.
  double dwell_s = 0;    ///< From the halt to the pull-back.
  double after_s = 0;    ///< Recorded after the pull-back.
  double latency_s = 0;  ///< As stated, or estimated from this tap.
  double drift_g_s = 0;
  double step_g = 0;                ///< By which the free nozzle's force is higher after the press.
  double lost_share = 0;            ///< Of the force, at rest.
  double touch_extra_mm = 0;        ///< By which the way down met the bed higher than the break.
  double pull_g = 0;                ///< Of the bed on the nozzle after the break.
  double press_noise = 1;           ///< Noise in the press over that of the free nozzle.
  std::vector<double> intervals_s;  ///< Between the samples, as recorded.

  /// Of the halt, if the force there were so much larger; to at most four times the present depth.
  [[nodiscard]] double DepthWith(double more_g) const;
};

/// @returns nothing where the moves hold no tap.
[[nodiscard]] std::optional<TapSetting> ReadSetting(const TapView& tap);

/// The stretches of a good tap before the touch and after the break.
[[nodiscard]] std::vector<FreeStretch> FreeStretchesOf(const TapView& tap,
                                                       const TapAnalysis& analysis);

/// @param analysis  Of the tap, by the contact method.
/// @param noise_g   Of one sample of the free nozzle.
/// @returns nothing where the tap is not good, or no press was fitted.
[[nodiscard]] std::optional<TapTemplate> ReadTemplate(const TapView& tap,
                                                      const TapAnalysis& analysis, double noise_g);

}  // namespace trammel::tap
