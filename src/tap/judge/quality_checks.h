// Checks of every tap, whatever method reads its height.
#pragma once

#include <limits>

#include "tap/judge/quality.h"
#include "tap/samples/tap.h"

namespace trammel::tap {

struct CheckOptions {
  /// Nozzle temperature when tapped, degC; NaN if unknown.
  double nozzle_temperature_c = std::numeric_limits<double>::quiet_NaN();
  /// Force at which the firmware stops the approach, gf; NaN: unknown.
  double trigger_force_g = std::numeric_limits<double>::quiet_NaN();
  /// Angle of a clean nozzle's decompression at 25 gf = 0.1 s; NaN if unknown.
  double decompression_angle_rad = std::numeric_limits<double>::quiet_NaN();
};

/// Sets result.quality and adds notices to it.
/// @returns the reason to refuse the tap, or code kNone. Of several reasons the one that explains
/// the others is first: bad samples, no tap, a press that never ended, then an unsuitable surface.
/// Cost: 2 us for 400 samples, no memory.
[[nodiscard]] Finding CheckTap(const CleanTap& clean, const TapMotion& motion,
                               const TapLines& lines, const CheckOptions& options,
                               TapAnalysis& result);

}  // namespace trammel::tap
