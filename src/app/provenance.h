// Which program found a result, and when.
#pragma once

#include <string>
#include <string_view>
#include <vector>

#include "measurement/outcome.h"

namespace trammel::app {

/// "trammel 0.1.0".
[[nodiscard]] std::string_view ProgramVersion();

/// Now, ISO 8601 to the second: "2026-01-02T03:04:05Z".
[[nodiscard]] std::string UtcNow();

/// The same of a time since 1970; of one that no calendar has, the number.
[[nodiscard]] std::string UtcOf(double since_1970_s);

/// This program, now, from those sources.
[[nodiscard]] measurement::Provenance ProvenanceOf(measurement::Instrument instrument,
                                                   std::vector<std::string> sources);

/// A folder for what an instrument records, now: "tap-20260102T030405Z".
[[nodiscard]] std::string RecordingName(measurement::Instrument instrument);

}  // namespace trammel::app
