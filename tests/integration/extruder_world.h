// Patterns printed by extruders of other laws than those the response fit was built on.
#pragma once

#include <functional>
#include <vector>

#include "base/random.h"
#include "pressure_advance/pattern/pattern_config.h"
#include "pressure_advance/profile/line_profile.h"

namespace trammel::test {

/// Filament stored at a steady flow (both in mm of line), of any scale, rising from 0.
using StoredModel = std::function<double(double flow_mm_s)>;

[[nodiscard]] StoredModel PowerLaw(double exponent);
/// Storage of which the share a saturates: (1 - a) q + a q0 tanh(q / q0).
[[nodiscard]] StoredModel TanhLaw(double share, double knee_mm_s);

/// One printer, its pattern, and the noise of the eye that reads it.
struct ExtruderWorld {
  StoredModel law = PowerLaw(1);  ///< scaled so that k_star_s is the secant over the speed change
  double k_star_s = 0.03;         ///< pattern's mean line; >= 0
  double second_share = 0;        ///< share of the storage in a second, linear stage behind it
  double lag_scatter_s = 0.0015;  ///< 1 sigma from line to line
  double lag_drift = 0;           ///< first line to last, relative to k_star_s
  double slip = 0;                ///< share of the drive lost at the fast flow; grows as its square
  bool gaps_are_lost = false;     ///< a gap draws in air rather than to be refilled
  double flow_scatter = 0.015;    ///< 1 sigma from line to line, relative
  double flow_noise = 0.01;       ///< 1 sigma along a line, relative, over flow_noise_length_mm
  double flow_noise_length_mm = 1.5;
  double reading_noise = 0.03;  ///< 1 sigma of one reading, relative to the nominal area

  double length_mm = 30;
  double first_share = 0.25;  ///< share of the line at slow_mm_s …
  double fast_share = 0.5;    ///< … and behind it at fast_mm_s; the rest slowly again
  double slow_mm_s = 5;
  double fast_mm_s = 150;
  double acceleration_mm_s2 = 3000;
  double smooth_time_s = 0.04;
  double left_out_mm = 4;       ///< at both ends of a line
  double reading_mm = 2.0 / 9;  ///< reading interval: 30 frames a second at 400 mm/min
  std::vector<double> pressure_advance_s;

  [[nodiscard]] pressure_advance::LineMotion Motion() const;
};

/// The pressure advance that supplies just what the mean line's speed change stores, slip counted.
[[nodiscard]] double TruePressureAdvance(const ExtruderWorld& world);

/// The lines and the scan of a preset.
[[nodiscard]] ExtruderWorld WorldOf(pressure_advance::PatternPreset preset);

/// Areas as a laser reads them, a reading every reading_mm.
[[nodiscard]] std::vector<pressure_advance::LineProfile> PrintPattern(const ExtruderWorld& world,
                                                                      Random& random);

/// The same lines as a photo shows them: widths in px over fractions of the line.
[[nodiscard]] std::vector<pressure_advance::LineProfile> SeenInAPhoto(
    std::vector<pressure_advance::LineProfile> profiles, double length_mm);

}  // namespace trammel::test
