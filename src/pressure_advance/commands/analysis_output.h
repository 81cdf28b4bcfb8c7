// What a finished analysis says on the terminal and leaves on disk.
#pragma once

#include <filesystem>
#include <string>

#include "app/output_files.h"
#include "app/result_file.h"
#include "pressure_advance/commands/analysis_run.h"

namespace trammel::app {

/// In a recording's folder: the figure that shows the answer.
inline constexpr const char* kResultPicture = "answer.png";

struct AnalysisOutput {
  bool json = false;               ///< one JSON object instead of text
  bool keep_in_recording = false;  ///< in the source, which is a recording's folder
  ReportFiles files;
};

/// Everything that an analysis leaves in its recording's folder: result, report and picture.
[[nodiscard]] AnalysisOutput KeptIn(const std::filesystem::path& recording, bool json);

/// Prints the answer on standard output, as text.
void SayAnswer(const pressure_advance::Analysis& analysis);

/// Writes the files and says nothing. Errors: the first that could not be written.
[[nodiscard]] Result<void> KeepAnalysis(const AnalysisRun& run, const ResultFile& result,
                                        const AnalysisOutput& output);

/// Writes the files, and says where; with `json` the answer, too.
/// @returns the exit code: that of the verdict, or of a file that could not be written.
int WriteAnalysis(const AnalysisRun& run, const ResultFile& result, const AnalysisOutput& output);

/// Prints the answer on standard output, then writes the files.
/// @param result  of the run, its source the recording or photo.
/// @returns the exit code: that of the verdict, or of a file that could not be written.
int PrintAnalysis(const AnalysisRun& run, const ResultFile& result, const AnalysisOutput& output);

}  // namespace trammel::app
