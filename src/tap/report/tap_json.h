// What was found in taps, as JSON.
#pragma once

#include <nlohmann/json_fwd.hpp>
#include <span>
#include <string>

#include "tap/ensemble/ensemble.h"
#include "tap/samples/tap.h"

namespace trammel::report {

/// A tap as recorded, with what was found in it.
struct AnalysedTap {
  tap::Recording recording;
  tap::TapAnalysis analysis;
  std::string unread;  ///< Why the file could not be read, in its place in a list; else empty.
};

/// One object (docs/reference/formats.md). Its three numbers are null unless the verdict
/// is good.
[[nodiscard]] nlohmann::ordered_json JsonOf(const AnalysedTap& tap);

/// A list of such objects, in the same order.
[[nodiscard]] nlohmann::ordered_json JsonOf(std::span<const AnalysedTap> taps);

/// One object: `taps`, that list, and `ensemble`, what they say together.
[[nodiscard]] nlohmann::ordered_json JsonOf(std::span<const AnalysedTap> taps,
                                            const tap::Ensemble& ensemble);

}  // namespace trammel::report
