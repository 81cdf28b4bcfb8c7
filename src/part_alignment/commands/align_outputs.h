// Output of the commands below `trammel align`: answers, reports, and the measurement folder.
#pragma once

#include <filesystem>
#include <functional>
#include <string>
#include <vector>

#include "app/output_files.h"
#include "base/measured.h"
#include "base/result.h"
#include "document/figure.h"
#include "machine/camera/camera.h"
#include "part_alignment/files/alignment_file.h"
#include "part_alignment/pose/solve.h"
#include "part_alignment/report/alignment_report.h"

namespace CLI {
class App;
}

namespace trammel::app {

/// Runs a command if it was chosen. Stores its exit code, or that of its error, which is printed.
void OnRun(CLI::App& command, int& exit_code, std::function<Result<int>()> run);

/// Output files of a metrology command.
struct AnswerOptions {
  std::string out;     ///< a file for what follows from a good answer; empty: none
  std::string report;  ///< a folder for report.html and the figures; empty: none
  bool json = false;
  bool force = false;  ///< overwrites files
};

/// Adds --out, --report, --json and --force.
void AddAnswerOptions(CLI::App& command, AnswerOptions& options, const std::string& out_help,
                      const std::string& report_help);

/// Checks before minutes of work that --out, the page and `others` can be written. Empty names are
/// skipped.
[[nodiscard]] Result<void> CheckFree(const AnswerOptions& options,
                                     const std::vector<std::string>& others = {});

struct AnswerReport {
  std::string page;
  std::vector<report::Figure> figures;
};

struct Answer {
  Verdict verdict = Verdict::kRefused;
  std::string json;
  std::string text;
  std::function<AnswerReport()> report = {};  ///< drawn where it is asked for
  std::vector<OutputFile> files = {};         ///< written with verdict good alone
};

/// Prints the answer, as JSON or text. Writes the page as report.html, each figure as PNG and SVG,
/// and the files of a good answer. @returns the exit code. Errors name the file: for example one
/// that exists already, unless --force.
[[nodiscard]] Result<int> GiveAnswer(const AnswerOptions& options, const Answer& answer);

/// Prints an alignment. On a terminal: its text alone, and the path of the JSON. Else the JSON on
/// standard output and, unless `json`, the text on standard error.
/// @param kept  the file that holds the JSON; empty: none
void PrintAlignment(const report::AlignmentOutput& output, const ResultFile& result, bool json,
                    const std::string& kept);

/// Returns the alignment as a result of this program with the current time: part_x … part_gamma,
/// and the solved unknowns of the clamping and the camera.
/// @param source  the observations' file, or the measurement's folder.
[[nodiscard]] ResultFile ResultOf(const report::AlignmentOutput& output, std::string source);

[[nodiscard]] part_alignment::SolveOptions SolveOptionsOf(const files::AlignmentInput& input);

/// Builds the output, with notices of what the stated uncertainty excludes (Caveats,
/// part_alignment/pose/solve.h).
[[nodiscard]] report::AlignmentOutput OutputOf(const files::AlignmentInput& input,
                                               part_alignment::Alignment alignment);

/// Writes result.json, report.txt, report.html and view-01_residuals.png … (found, projected,
/// residual in each) into a folder, which is made if needed. The page holds the pictures of the six
/// views with the largest residuals.
/// @param result  of the same output; absent: no result.json.
/// @param pictures  of the views; an empty path, or none, draws the targets on a grey ground.
/// Errors name the file: one that cannot be written or, unless `force`, exists already; a picture
/// that cannot be read or is not of the camera's size.
[[nodiscard]] Result<void> WriteAlignmentReport(const std::filesystem::path& folder,
                                                const report::AlignmentOutput& output,
                                                const ResultFile* result,
                                                const std::vector<std::filesystem::path>& pictures,
                                                bool force);

/// Writes a picture unchanged: view-01.png (or .jpg) for view 0. @returns its name. Errors name the
/// file.
[[nodiscard]] Result<std::string> WritePicture(const std::filesystem::path& folder,
                                               std::size_t view,
                                               const machine::CapturedFrame& picture);

/// Record of a measurement, made with the first picture: DIR/part_alignment-20261122T030405Z, with
/// the suffix -2 if that exists. Holds view-01.png (or .jpg) … and observations.json, both readable
/// at any moment.
class AlignmentRecord {
 public:
  /// @param plan  its camera, targets and unknowns are written with the observations
  AlignmentRecord(std::filesystem::path parent, files::AlignmentInput plan);

  /// Checks that the folder can be created, before anything moves.
  [[nodiscard]] Result<void> CheckPlace() const;
  /// Stores the picture unchanged. Errors name the file.
  [[nodiscard]] Result<void> KeepPicture(std::size_t view, const machine::CapturedFrame& picture);
  [[nodiscard]] Result<void> KeepObservations(const part_alignment::Measurement& so_far);
  /// Writes stopped.txt, and returns the error with the folder of the record.
  [[nodiscard]] Error Stopped(const Error& error, const std::vector<std::string>& notices) const;

  [[nodiscard]] const std::filesystem::path& folder() const { return folder_; }
  [[nodiscard]] std::vector<std::filesystem::path> pictures() const;

 private:
  [[nodiscard]] Result<void> MakeFolder();

  std::filesystem::path parent_;
  std::filesystem::path folder_;  ///< empty until it is made
  files::AlignmentInput input_;
};

}  // namespace trammel::app
