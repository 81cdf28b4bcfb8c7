// What a finished analysis says on the terminal and leaves on disk.
#pragma once

#include <string>

#include "app/analysis_run.h"
#include "base/result.h"

namespace trammel::app {

struct AnalysisOutput {
  bool json = false;    ///< one JSON object instead of text
  std::string report;   ///< HTML file to write; empty: none
  std::string figures;  ///< folder for each figure as PNG and SVG; empty: none
  bool force = false;   ///< overwrite files
};

/// Whether the files can be written, asked before the analysis rather than behind it: minutes of
/// work need not go without their report. Errors name the option.
[[nodiscard]] Result<void> CheckOutputs(const AnalysisOutput& output);

/// Prints the answer on standard output and writes the files.
/// @param source  path of the recording or photo, for the report.
/// @returns the exit code: that of the verdict, or of a file that could not be written.
int PrintAnalysis(const AnalysisRun& run, const std::string& source, const AnalysisOutput& output);

}  // namespace trammel::app
