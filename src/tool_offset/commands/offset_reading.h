#pragma once

#include <CLI/CLI.hpp>
#include <optional>
#include <string>
#include <vector>

#include "base/result.h"
#include "measurement/outcome.h"
#include "tool_offset/offset/analyse.h"
#include "tool_offset/report/offset_report.h"

namespace trammel::app {

/// Options that supplement the files' own statements.
struct ReadingOptions {
  std::vector<double> dpi =
      {};                       ///< along a row and down the page, or both in one; empty: as stated
  double max_megapixels = 400;  ///< per page
  bool photo = false;           ///< it is one; else it is told from the picture, or by dpi a scan
  std::optional<double> film_focal_mm = {};  ///< photos only
  tool_offset::RadialSpread spread = {};
};

/// Adds --dpi, --photo and --film-focal.
void AddReadingOptions(CLI::App& command, ReadingOptions& options);

/// Reads the plan of a printed sheet from its G-code, ours or the original generator's. Errors
/// (kInput) name the file.
[[nodiscard]] Result<tool_offset::SheetPlan> ReadPlan(const std::string& pattern);

/// Separator among the files: the next ones are of another print of the sheet.
inline constexpr const char* kNextSheet = "+";

struct ReadSheets {
  report::OffsetAnalysis analysis;            ///< combined where there is any scan
  std::vector<report::DrawnFigure> pictures;  ///< of the pages; empty where not wanted
  std::vector<Error> errors;                  ///< one for each refused file
};

/// Reads every page of all files, and combines them by their sheets; photos of one print yield one
/// result. Errors: kInput of a file that is no page; kMeasurement of a page that is refused.
[[nodiscard]] ReadSheets ReadScans(const std::vector<std::string>& files,
                                   const tool_offset::SheetPlan& plan,
                                   const ReadingOptions& options, bool pictures);

struct OffsetOutput {
  std::string report;        ///< HTML file to write; empty: none
  std::string figures;       ///< folder for each figure as SVG; empty: none
  std::string result;        ///< result.json to write; empty: none
  std::string picture = {};  ///< PNG of where the tools land, for small screens; empty: none
  /// Folder that stores the result as result.json; empty: none.
  std::string recording = {};
  measurement::Subject subject = {};
  bool force = false;  ///< overwrite report, figures and result

  [[nodiscard]] bool has_pictures() const { return !report.empty() || !figures.empty(); }
};

/// Writes the requested outputs; errors name the option or the file.
[[nodiscard]] Result<void> WriteOffsetOutput(const OffsetOutput& output,
                                             const report::OffsetReportInput& input);

}  // namespace trammel::app
