// One HTML page on scanned sheets of combs.
#pragma once

#include <string>
#include <vector>

#include "tool_offset/report/offset_figures.h"

namespace trammel::report {

struct OffsetReportInput {
  const OffsetAnalysis* analysis = nullptr;  ///< REQUIRED
  std::vector<OffsetScanPictures> pictures;  ///< one for each of its scans
  std::vector<std::string> failed;           ///< scans that could not be read: why
  std::vector<KeptChange> kept = {};         ///< where the printer's own offsets are known
};

/// The figures of values: tools, self-test, pick-ups, axes.
[[nodiscard]] std::vector<DrawnFigure> OffsetValueFigures(const OffsetAnalysis& analysis);

/// Stands alone: nothing is loaded from elsewhere. Text from outside may hold any bytes.
[[nodiscard]] std::string OffsetReport(const OffsetReportInput& input);

}  // namespace trammel::report
