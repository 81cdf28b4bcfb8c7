// What was read on scanned sheets, as JSON.
#pragma once

#include <nlohmann/json_fwd.hpp>
#include <string>
#include <vector>

#include "base/measured.h"
#include "tool_offset/reading/combine.h"
#include "tool_offset/reading/sheet_result.h"
#include "tool_offset/sheet/sheet_plan.h"

namespace trammel::report {

/// One page of one file.
struct OffsetScan {
  std::string source;  ///< the file, as it was named
  int page = 1;        ///< of the file
  int sheet = 1;       ///< scans of one print share it
  tool_offset::SheetResult result;
};

/// A scan whose sheet could not be used, and why.
struct RefusedScan {
  std::string source;
  std::string reason;
};

struct OffsetAnalysis {
  tool_offset::SheetPlan plan;
  std::vector<OffsetScan> scans;  ///< at least one, but for RefusalJson
  tool_offset::CombinedResult combined;
  std::vector<RefusedScan> refused;  ///< that say nothing
};

/// Good where all tools and self-tests are; otherwise the worst of them.
[[nodiscard]] Verdict VerdictOf(const OffsetAnalysis& analysis);
/// Good where both axes are; otherwise the worse of them.
[[nodiscard]] Verdict VerdictOf(const tool_offset::CombinedTool& tool);
/// Empty where good; otherwise what is wrong with either axis, said once where both say the same.
[[nodiscard]] std::string ReasonOf(const tool_offset::CombinedTool& tool);
/// What the scans have to say about the tool's value, each once.
[[nodiscard]] std::vector<std::string> NoticesOf(const OffsetAnalysis& analysis, int tool);
/// What the scans have to say about themselves, each once.
[[nodiscard]] std::vector<std::string> NoticesOf(const OffsetAnalysis& analysis);

/// One object (docs/formats.md). A tool's numbers are null unless its verdict
/// is good, and so is every other value that could not be measured.
/// @param report  path of the report that was written; empty where there is none.
[[nodiscard]] nlohmann::ordered_json JsonOf(const OffsetAnalysis& analysis,
                                            const std::string& report = "");

/// The same where no scan could be used: every tool is refused, with the scans' reasons.
/// REQUIRES at least one refused scan and no other.
[[nodiscard]] nlohmann::ordered_json RefusalJson(const OffsetAnalysis& analysis);

}  // namespace trammel::report
