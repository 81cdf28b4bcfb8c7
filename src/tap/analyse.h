// The door of the room: one tap in, what a method says of it out.
#pragma once

#include "tap/tap.h"

namespace trammel::tap {

struct TapOptions {
  Method method = Method::kContact;
  double latency_s = 0;              ///< By which a force is read after it acted; >= 0.
  double latency_uncertainty_s = 0;  ///< Its standard uncertainty; >= 0.
  /// Of the nozzle when tapped, degC; NaN where it is not known. Hot plastic oozes.
  double nozzle_temperature_c = __builtin_nan("");
};

/// Analyses taps one after the other with memory that it keeps: nothing is allocated once it has
/// seen the longest of them. One per thread.
class TapAnalyser {
 public:
  explicit TapAnalyser(const TapOptions& options);
  [[nodiscard]] TapAnalysis Analyse(const TapView& tap);
};

}  // namespace trammel::tap
