// What was read on scanned sheets, in words and figures for a terminal.
#pragma once

#include <string>

#include "tool_offset/report/offset_json.h"

namespace trammel::report {

/// A table of the tools, the play of the axes; several lines.
[[nodiscard]] std::string OffsetAnswer(const OffsetAnalysis& analysis,
                                       const std::string& report = "");

/// The same, and what to do next.
/// @param report  path of the report that was written; empty where there is none.
[[nodiscard]] std::string OffsetText(const OffsetAnalysis& analysis,
                                     const std::string& report = "");

}  // namespace trammel::report
