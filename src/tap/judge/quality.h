// Quality of a tap: the published score, and the checks for any method's tap.
#pragma once

#include <limits>

#include "tap/samples/corruption.h"
#include "tap/two_line/tap_lines.h"

namespace trammel::tap {

/// Components of the published score, and further signs of a bad tap. Ratios are of the compression
/// force, 0 in an ideal tap; NaN if a part of the tap was not found.
struct TapShape {
  double compression_g = 0;      ///< touch to press end; as published
  double decompression_g = 0;    ///< dwell end to break
  double approach_ratio = 0;     ///< Change of force along the approach's line.
  double departure_ratio = 0;    ///< Along the departure's, to the pull-back's end.
  double baseline_ratio = 0;     ///< Between touch and break.
  double dwell_ratio = 0;        ///< Lost between press end and dwell end.
  double lost_ratio = 0;         ///< The same from the peak's samples to the last at rest.
  double decompression_rad = 0;  ///< Slope of the decompression at 25 gf = 0.1 s.
  /// Difference between the baselines that the drift of both does not explain, gf.
  double unexplained_baseline_g = 0;
  double press_depth_mm = 0;  ///< halt to break, upwards
  double touch_depth_mm = 0;  ///< From the touch on the way down to the halt.
  /// Fall of the force below the free nozzle's after the break, gf, mean of some samples.
  double pull_g = 0;
  double pull_noise_g = 0;  ///< Standard deviation of such a mean.
};

[[nodiscard]] TapShape MeasureShape(const CleanTap& clean, const TapMotion& motion,
                                    const TapLines& lines);

/// Computes the published score, 0 … 100: 100 (1 - approach) (1 - departure) (1 - baseline) (1 -
/// dwell) (1 - |angle / calibrated angle - 1|), where a ratio beyond its limit (approach 50 %,
/// departure and baseline 25 %, dwell 75 %) counts as 1. Without a calibrated angle (NaN) the last
/// factor is omitted. NaN if the tap's lines were not found.
[[nodiscard]] double Score(const TapShape& shape, double calibrated_angle_rad);

/// Minimum score of a good tap: the published default.
inline constexpr double kMinScore = 40;

}  // namespace trammel::tap
