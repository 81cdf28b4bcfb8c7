// Writes the result of scanned sheets as text, and as rows of one table.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "base/measured.h"
#include "document/page.h"
#include "tool_offset/reading/combine.h"
#include "tool_offset/reading/sheet_result.h"
#include "tool_offset/sheet/sheet_plan.h"

namespace trammel::report {

/// One page of one file.
struct OffsetScan {
  std::string source;  ///< the file, as it was named
  int page = 1;        ///< page of the file
  int sheet = 1;       ///< scans of one print share it
  tool_offset::SheetResult result;
};

/// Scan whose sheet was unusable, with the reason.
struct RefusedScan {
  std::string source;
  std::string reason;
};

struct OffsetAnalysis {
  tool_offset::SheetPlan plan;
  std::vector<OffsetScan> scans;  ///< at least one, except for RefusalJson
  tool_offset::CombinedResult combined;
  std::vector<RefusedScan> refused;
};

/// Returns good if all tools and self-tests are; otherwise the worst of them.
[[nodiscard]] Verdict VerdictOf(const OffsetAnalysis& analysis);
/// Lists the reasons why the answer is not good, each once; empty if it is.
[[nodiscard]] std::string ReasonOf(const OffsetAnalysis& analysis);
/// Returns good if both axes are; otherwise the worse of them.
[[nodiscard]] Verdict VerdictOf(const tool_offset::CombinedTool& tool);
/// Returns the reason of either axis, once if both have the same; empty if good.
[[nodiscard]] std::string ReasonOf(const tool_offset::CombinedTool& tool);
/// Returns the notices of all scans on a tool, each once.
[[nodiscard]] std::vector<std::string> NoticesOf(const OffsetAnalysis& analysis, int tool);
/// Returns the notices of all scans, each once.
[[nodiscard]] std::vector<std::string> NoticesOf(const OffsetAnalysis& analysis);

/// Kind of a row of the answer.
enum class OffsetRowKind { kTool, kSelfTest, kPickUp, kBacklash, kBias };

struct OffsetRow {
  OffsetRowKind kind = OffsetRowKind::kTool;
  std::string name;           ///< "T1", "self-test X 3, -0.28 mm"
  Measured x;                 ///< mm; of a self-test the recovered offset
  std::optional<Measured> y;  ///< mm; absent for a self-test
  std::string remark;         ///< "coarse"; mostly empty
  std::vector<std::string> notices;

  /// Returns the worse of both axes.
  [[nodiscard]] Verdict verdict() const;
  /// Returns the reason of either axis, once if both have the same; empty if good.
  [[nodiscard]] std::string reason() const;
};

/// Returns every row of the result: tools, self-tests, pick-ups, backlash, the method's bias.
[[nodiscard]] std::vector<OffsetRow> OffsetTable(const OffsetAnalysis& analysis);

/// Describes a scan or photo: "600.0 x 600.0 dpi, lines scatter by 2.1 µm".
[[nodiscard]] std::string ScanFacts(const OffsetScan& scan);
/// "sheet 1234", or that it is of the original generator.
[[nodiscard]] std::string SheetName(const tool_offset::SheetPlan& plan);

/// Returns the table for a terminal, the scans' facts and notices; several lines.
/// @param report  path of the report that was written; empty if there is none.
[[nodiscard]] std::string OffsetText(const OffsetAnalysis& analysis,
                                     const std::string& report = "");

/// "+0.3123 mm (95 %: +0.3102 to +0.3144 mm)", or the verdict.
[[nodiscard]] std::string OffsetText(const Measured& measured);

}  // namespace trammel::report
