// The door of the room: one tap in, what a method says of it out.
#pragma once

#include <cstddef>
#include <vector>

#include "tap/tap.h"
#include "tap/two_line_fit.h"
#include "tap/workspace.h"

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
  TwoLineOptions two_line = {};
};

/// Bytes of workspace that suffice for taps of so many samples, with either method.
[[nodiscard]] std::size_t WorkspaceBytes(std::size_t samples);

/// Analyses one tap in memory of the caller. Allocates nothing and throws nothing; whatever the tap
/// holds, the answer is an analysis.
[[nodiscard]] TapAnalysis AnalyseTap(const TapView& tap, const TapOptions& options,
                                     Workspace& workspace);

/// Analyses taps one after the other with memory that it keeps: nothing is allocated once it has
/// seen the longest of them. One per thread.
class TapAnalyser {
 public:
  explicit TapAnalyser(const TapOptions& options) : options_(options) {}
  [[nodiscard]] TapAnalysis Analyse(const TapView& tap);

 private:
  TapOptions options_;
  std::vector<std::byte> memory_;
};

}  // namespace trammel::tap
