// What is asked of every tap, whichever method reads its height.
#pragma once

#include <limits>

#include "tap/judge/quality.h"
#include "tap/samples/tap.h"

namespace trammel::tap {

struct CheckOptions {
  /// Of the nozzle when tapped, degC; NaN where it is not known.
  double nozzle_temperature_c = std::numeric_limits<double>::quiet_NaN();
  /// Force at which the firmware stops the approach, gf; NaN where it is not known.
  double trigger_force_g = std::numeric_limits<double>::quiet_NaN();
  /// Of the decompression at 25 gf = 0.1 s, of a clean nozzle; NaN where it is not known.
  double decompression_angle_rad = std::numeric_limits<double>::quiet_NaN();
};

/// Sets result.quality and adds notices to it.
/// @returns why the tap must be refused, code kNone where it need not. Of several reasons the one
///          that explains the others comes first: bad samples, no tap, a press that never ended,
///          then what was pressed on.
/// Cost: 2 us for 400 samples, no memory.
[[nodiscard]] Finding CheckTap(const CleanTap& clean, const TapMotion& motion,
                               const TapLines& lines, const CheckOptions& options,
                               TapAnalysis& result);

}  // namespace trammel::tap
