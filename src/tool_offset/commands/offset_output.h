// What a finished reading of sheets leaves on disk.
#pragma once

#include <string>

#include "base/result.h"
#include "measurement/outcome.h"
#include "tool_offset/report/offset_report.h"

namespace trammel::app {

struct OffsetOutput {
  std::string report;        ///< HTML file to write; empty: none
  std::string figures;       ///< folder for each figure as SVG; empty: none
  std::string result;        ///< result.json to write; empty: none
  std::string picture = {};  ///< PNG of where the tools land, for small screens; empty: none
  /// Folder that keeps the answer as result.json; empty: none.
  std::string recording = {};
  measurement::Subject subject = {};
  bool force = false;  ///< overwrite report, figures and result

  [[nodiscard]] bool has_pictures() const { return !report.empty() || !figures.empty(); }
};

/// Writes what is wanted; errors name the option or the file.
[[nodiscard]] Result<void> WriteOffsetOutput(const OffsetOutput& output,
                                             const report::OffsetReportInput& input);

}  // namespace trammel::app
