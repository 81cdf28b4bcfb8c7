// By which method a tap is read, and what its machine says of itself.
#pragma once

#include "tap/samples/tap.h"

namespace trammel::tap {

struct TapOptions {
  Method method = Method::kContact;
  /// By which a sample's time is after its force acted; below 0 where a host dates samples too
  /// early. NaN where it is not known: the contact method then estimates it from the approach, the
  /// two-line method takes 0.
  double latency_s = __builtin_nan("");
  double latency_uncertainty_s = 0;  ///< Standard uncertainty of a stated latency; >= 0.
  /// Of the nozzle when tapped, degC; NaN where it is not known. Hot plastic oozes.
  double nozzle_temperature_c = __builtin_nan("");
  /// At which the firmware stops the approach, gf; NaN where it is not known. Checked only.
  double trigger_force_g = __builtin_nan("");
  /// Of the decompression of a clean nozzle at 25 gf = 0.1 s, a factor of the published score; NaN
  /// leaves it out.
  double decompression_angle_rad = __builtin_nan("");
};

}  // namespace trammel::tap
