// From a path on the command line to a finished analysis: a recording's folder or a photo.
#pragma once

#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "app/output_files.h"
#include "base/result.h"
#include "pressure_advance/pattern/pattern_config.h"
#include "pressure_advance/photo/photo_eye.h"
#include "pressure_advance/profile/analysis.h"
#include "pressure_advance/profile/line_profile.h"
#include "pressure_advance/recording/scan.h"
#include "pressure_advance/report/pressure_advance_figures.h"

namespace trammel::app {

using report::AnalysisRun;

/// Puts a busy computer before what its lost and late frames led to: in the reason of each line
/// that was not used, and in the answer's, where half of these lines suffered from it.
/// @param analysis  of the scan's lines, in their order.
void BlameBusyComputer(const pressure_advance::Scan& scan, pressure_advance::Analysis& analysis);

/// Analyses a recorded laser scan. A recording that does not hold what its scan.json promises (a
/// missing, empty or broken video) gives a refused analysis; a scan.json that cannot be used gives
/// an error.
[[nodiscard]] Result<AnalysisRun> AnalyseRecording(const std::filesystem::path& folder);

/// What a photo cannot tell of itself.
struct PhotoPlan {
  std::vector<double> pressure_advance_s;            ///< of the lines, from the first one's side on
  std::optional<pressure_advance::PhotoSide> from;   ///< absent: found
  std::optional<pressure_advance::PhotoSide> start;  ///< where printing began; absent: found
  bool corner_mark = false;                          ///< PhotoOptions::corner_mark
  std::optional<gcode::PrintedBy> printed_by = {};   ///< absent: not known
  std::vector<pressure_advance::Segment> segments = pressure_advance::PhotoSegments();
};

/// Analyses a photo of a printed pattern (JPEG, PNG, WebP or HEIC). A photo in which the pattern
/// cannot be measured gives a refused analysis; a file that is no picture gives an error.
[[nodiscard]] Result<AnalysisRun> AnalysePhoto(const std::filesystem::path& file,
                                               const PhotoPlan& plan);

// What a finished analysis says on the terminal and leaves on disk.

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
