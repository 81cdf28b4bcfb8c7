// Results of taps, as JSON.
#pragma once

#include <nlohmann/json_fwd.hpp>
#include <span>
#include <string>

#include "tap/ensemble/ensemble.h"
#include "tap/samples/tap.h"

namespace trammel::report {

/// Recorded tap with its analysis.
struct AnalysedTap {
  tap::Recording recording;
  tap::TapAnalysis analysis;
  std::string unread;  ///< why the file could not be read, in its place in a list; else empty
};

/// Returns one object (docs/reference/formats.md). Its three numbers are null unless the verdict is
/// good.
[[nodiscard]] nlohmann::ordered_json JsonOf(const AnalysedTap& tap);

/// Returns the curve for a chart: `time_s`, `z_mm`, `force_g` from shortly before the halt on, at
/// most 600 samples (forces count from the last one, a press is positive), and `contact_time_s`,
/// `contact_force_g` (null unless the verdict is good). Null where the moves hold no tap.
[[nodiscard]] nlohmann::ordered_json CurveJson(const AnalysedTap& tap);

/// Returns a list of such objects, in the same order.
[[nodiscard]] nlohmann::ordered_json JsonOf(std::span<const AnalysedTap> taps);

/// Returns one object: `taps`, that list, and `ensemble`, their common results.
[[nodiscard]] nlohmann::ordered_json JsonOf(std::span<const AnalysedTap> taps,
                                            const tap::Ensemble& ensemble);

}  // namespace trammel::report
