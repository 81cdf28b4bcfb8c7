// The answer of scanned sheets as JSON (docs/formats.md).
#pragma once

#include <nlohmann/json_fwd.hpp>
#include <string>

#include "tool_offset/report/offset_table.h"

namespace trammel::report {

/// One object. A tool's numbers are null unless its verdict is good, and so is every other value
/// that could not be measured.
/// @param report  path of the report that was written; empty where there is none.
[[nodiscard]] nlohmann::ordered_json JsonOf(const OffsetAnalysis& analysis,
                                            const std::string& report = "");

/// The same where no scan could be used: every tool is refused, with the scans' reasons.
/// REQUIRES at least one refused scan and no other.
[[nodiscard]] nlohmann::ordered_json RefusalJson(const OffsetAnalysis& analysis);

}  // namespace trammel::report
