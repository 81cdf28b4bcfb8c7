// What was read on scanned sheets, as JSON.
#pragma once

#include <string>
#include <vector>

#include "base/measured.h"
#include "tool_offset/combine.h"
#include "tool_offset/sheet_plan.h"
#include "tool_offset/sheet_result.h"

namespace trammel::report {

/// One page of one file.
struct OffsetScan {
  std::string source;  ///< the file, as it was named
  int page = 1;        ///< of the file
  int sheet = 1;       ///< scans of one print share it
  tool_offset::SheetResult result;
};

struct OffsetAnalysis {
  tool_offset::SheetPlan plan;
  std::vector<OffsetScan> scans;  ///< at least one
  tool_offset::CombinedResult combined;
};

/// Good where both axes are; otherwise the worse of them.
[[nodiscard]] Verdict VerdictOf(const tool_offset::CombinedTool& tool);
/// Empty where good; otherwise what is wrong with either axis, said once where both say the same.
[[nodiscard]] std::string ReasonOf(const tool_offset::CombinedTool& tool);
/// What the scans have to say about the tool's value, each once.
[[nodiscard]] std::vector<std::string> NoticesOf(const OffsetAnalysis& analysis, int tool);
/// What the scans have to say about themselves, each once.
[[nodiscard]] std::vector<std::string> NoticesOf(const OffsetAnalysis& analysis);

/// One object (docs/formats.md), ended by a newline. A tool's numbers are null unless its verdict
/// is good, and so is every other value that could not be measured.
/// @param report  path of the report that was written; empty where there is none.
[[nodiscard]] std::string ToJson(const OffsetAnalysis& analysis, const std::string& report = "");

}  // namespace trammel::report
