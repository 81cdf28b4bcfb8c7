// Analysis of a path from the command line: a recording's folder or a photo.
#pragma once

#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "app/output_files.h"
#include "base/result.h"
#include "pressure_advance/profile/analysis.h"
#include "pressure_advance/profile/line_profile.h"
#include "pressure_advance/recording/scan.h"
#include "pressure_advance/report/pressure_advance_figures.h"

namespace trammel::app {

using report::AnalysisRun;

/// Adds a busy computer as the cause of lost and late frames: to the reason of each unused line,
/// and to the answer's, if half of these lines were affected.
/// @param analysis  of the scan's lines, in their order.
void BlameBusyComputer(const pressure_advance::Scan& scan, pressure_advance::Analysis& analysis);

/// Scan of a pattern whose right flow ratio is known, on the same plate with the same camera.
struct FlowReference {
  std::filesystem::path folder;
  double ratio = 1;  ///< 0.2 … 5: right for that print's filament
};

/// Returns an analysis of nothing that could be measured.
[[nodiscard]] AnalysisRun RefusedRun(const std::string& reason);

/// Analyses a recorded laser scan. If the recording lacks data that its scan.json promises (a
/// missing, empty or broken video), the analysis is refused; an unusable scan.json is an error.
/// @param reference  for the flow ratio. Errors (kInput): it cannot be read, has no flow ratio's
///     areas, or was scanned with another scale or laser angle.
[[nodiscard]] Result<AnalysisRun> AnalyseRecording(
    const std::filesystem::path& folder, const std::optional<FlowReference>& reference = {});

// Output of a finished analysis on the terminal and on disk.

struct AnalysisOutput {
  bool json = false;               ///< one JSON object instead of text
  bool keep_in_recording = false;  ///< in the source, a recording's folder
  ReportFiles files;
};

/// Returns all output files of an analysis in its recording's folder: result, report and picture.
[[nodiscard]] AnalysisOutput KeptIn(const std::filesystem::path& recording, bool json);

/// Prints the answer as text on standard output.
void PrintAnswer(const pressure_advance::Analysis& analysis);

/// Writes the files without printing. Errors: the first that could not be written.
[[nodiscard]] Result<void> KeepAnalysis(const AnalysisRun& run, const ResultFile& result,
                                        const AnalysisOutput& output);

/// Writes the files and prints their paths; with `json` the answer, too.
/// @returns the exit code: that of the verdict, or of a file that could not be written.
int WriteAnalysis(const AnalysisRun& run, const ResultFile& result, const AnalysisOutput& output);

/// Prints the answer on standard output, then writes the files.
/// @param result  of the run, its source the recording or photo.
/// @returns the exit code: that of the verdict, or of a file that could not be written.
int PrintAnalysis(const AnalysisRun& run, const ResultFile& result, const AnalysisOutput& output);

}  // namespace trammel::app
