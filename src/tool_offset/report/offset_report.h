// One HTML page on scanned sheets of combs.
#pragma once

#include <string>
#include <vector>

#include "tool_offset/offset/correction.h"
#include "tool_offset/report/offset_figures.h"

namespace trammel::report {

/// The offset that a printer keeps for a tool, and the one that it is to keep.
struct KeptChange {
  int tool = 0;
  tool_offset::KeptOffset now;
  tool_offset::KeptOffset next;
};

struct OffsetReportInput {
  const OffsetAnalysis* analysis = nullptr;  ///< REQUIRED
  std::vector<OffsetScanPictures> pictures;  ///< one for each of its scans
  std::vector<KeptChange> kept = {};         ///< where the printer's own offsets are known
};

/// The figures of values: where the tools land, each scan by itself.
[[nodiscard]] std::vector<Figure> OffsetValueFigures(const OffsetAnalysis& analysis);

/// Stands alone: nothing is loaded from elsewhere. Text from outside may hold any bytes.
[[nodiscard]] std::string OffsetReport(const OffsetReportInput& input);

}  // namespace trammel::report
