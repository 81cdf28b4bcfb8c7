// Prints patterns with a simulated extruder, as a scan reads them. Written apart from the response
// fit and from its own worlds (extruder_world.h): another model of the melt.
#pragma once

#include <cstddef>
#include <vector>

#include "base/random.h"
#include "melt_extruder.h"
#include "pressure_advance/pattern/pattern_config.h"
#include "pressure_advance/profile/line_profile.h"

namespace trammel::test {

/// Describes where a line is printed how fast, and where it is read.
struct MeltLine {
  double length_mm = 25;
  double first_share = 0.16;  ///< share of the line at slow_mm_s …
  double fast_share = 0.6;    ///< … and behind it at fast_mm_s; the rest slowly again
  double slow_mm_s = 10;
  double fast_mm_s = 150;
  double acceleration_mm_s2 = 3000;
  double smooth_time_s = 0.04;
  double left_out_mm = 0.8;  ///< at both ends
  double reading_mm = 0.67;  ///< reading interval
};

enum class MeltNoise { kEven, kWithTheArea, kHeavyTails };

/// One printer, its pattern, and the noise of print and reading.
struct MeltWorld {
  MeltPhysics physics;
  double swell = 0;               ///< area read beyond the filament's at the fast flow; ~ its root
  double lag_scatter_s = 0.0015;  ///< 1 sigma from line to line
  bool lag_tails = false;         ///< Student's t of 3 degrees of freedom, else normal
  double viscosity_drift = 0;     ///< first line to last, relative
  double flow_scatter = 0.015;    ///< 1 sigma from line to line, relative
  double flow_noise = 0.01;       ///< 1 sigma along a line, relative, over flow_noise_length_mm
  double flow_noise_length_mm = 1.5;
  double reading_noise = 0.03;  ///< 1 sigma of one reading, over the nominal area
  MeltNoise reading = MeltNoise::kEven;
  MeltLine line;
  std::vector<double> pressure_advance_s;

  [[nodiscard]] pressure_advance::LineMotion Motion() const;
};

/// Returns the default printer with the lines and the scan of a preset.
[[nodiscard]] MeltWorld MeltWorldOf(pressure_advance::PatternPreset preset);

/// Computes the pressure advance that supplies the filament by which the storage of the mean line
/// differs between long steady printing at the fast and at the slow speed, slip counted.
[[nodiscard]] double SteadyPressureAdvance(const MeltWorld& world);

/// Computes the pressure advance at which the mean line's surplus behind the acceleration and
/// behind the deceleration sum to zero, each for as long as the line lasts.
[[nodiscard]] double LinePressureAdvance(const MeltWorld& world);

/// Areas laid by one pattern, without noise, relative to the nominal one, kBin_mm apart.
struct MeltPrint {
  std::vector<std::vector<double>> area;     ///< per line, as filament was laid
  std::vector<std::vector<double>> swollen;  ///< per line, as it is read
  double driven_mm = 0, laid_mm = 0, oozed_mm = 0, slipped_mm = 0, stored_mm = 0;
};
inline constexpr double kBin_mm = 0.02;

/// Prints lines of the given pressure advances, and two more before the first to fill the nozzle.
/// @param compliance  per line, factor of the mean line's
[[nodiscard]] MeltPrint PrintLines(const MeltWorld& world, const std::vector<double>& advances_s,
                                   const std::vector<double>& compliance = {});

/// Prints and reads a pattern.
[[nodiscard]] std::vector<pressure_advance::LineProfile> PrintMeltPattern(const MeltWorld& world,
                                                                          Random& random);

}  // namespace trammel::test
