// Writes the result of sheets of combs as one HTML page, and as JSON (docs/reference/formats.md).
#pragma once

#include <nlohmann/json_fwd.hpp>
#include <string>
#include <vector>

#include "tool_offset/offset/correction.h"
#include "tool_offset/report/offset_figures.h"
#include "tool_offset/report/offset_table.h"

namespace trammel::report {

/// Present and next stored offset of a tool.
struct KeptChange {
  int tool = 0;
  tool_offset::KeptOffset now;
  tool_offset::KeptOffset next;
};

struct OffsetReportInput {
  const OffsetAnalysis* analysis = nullptr;  ///< REQUIRED
  std::vector<DrawnFigure> pictures;         ///< of the pages, one for each of its scans
  std::vector<KeptChange> kept = {};         ///< if the printer's own offsets are known
};

/// Draws the figures of values: the tools' positions, each scan by itself.
[[nodiscard]] std::vector<Figure> OffsetValueFigures(const OffsetAnalysis& analysis);

/// Returns a self-contained page: nothing is loaded from elsewhere. Text from outside may have any
/// bytes.
[[nodiscard]] std::string OffsetReport(const OffsetReportInput& input);

/// Returns one object. A tool's numbers are null unless its verdict is good, and so is every other
/// value that could not be measured.
/// @param report  path of the report that was written; empty if there is none.
[[nodiscard]] nlohmann::ordered_json JsonOf(const OffsetAnalysis& analysis,
                                            const std::string& report = "");

/// Returns the object if no scan was usable: every tool is refused, with the scans' reasons.
/// REQUIRES at least one refused scan and no other.
[[nodiscard]] nlohmann::ordered_json RefusalJson(const OffsetAnalysis& analysis);

}  // namespace trammel::report
