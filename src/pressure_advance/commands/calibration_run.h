// Common parts of the commands that print and scan: one run into one folder, and its dry run.
#pragma once

#include <filesystem>
#include <optional>
#include <stop_token>
#include <string>
#include <vector>

#include "app/config/config_file.h"
#include "app/printer_session.h"
#include "base/result.h"
#include "pressure_advance/commands/analysis_run.h"
#include "pressure_advance/commands/photo_analysis.h"
#include "pressure_advance/files/plan_file.h"
#include "pressure_advance/pattern/pattern_geometry.h"
#include "pressure_advance/procedure/calibrate.h"
#include "session/session.h"

namespace CLI {
class App;
}

namespace trammel::app {

/// --keep-full, of what scans.
void AddKeepFullOption(CLI::App& command, bool& keep_full);

/// Returns the request of a run of `config` into `folder`, starting now.
[[nodiscard]] procedure::CalibrationRequest RequestFor(const files::Config& config,
                                                       std::filesystem::path folder);

/// Prints on standard error which settings were not restored, and `so_far` with the folder if the
/// run failed and left data in it.
/// @returns `done`; for a successful run an error (kMachine) if the printer was not restored.
[[nodiscard]] Result<void> ReportEnd(const Result<void>& done,
                                     const std::vector<std::string>& unrestored,
                                     const std::filesystem::path& folder, const char* so_far);

struct CalibrationRun {
  Result<void> done;      ///< the recording is whole, and the printer as it was
  bool recorded = false;  ///< the recording is whole, whatever became of the printer
  double bed_c = 0;       ///< bed temperature
};

/// Runs the steps, records a print (NotePrint), and reports their end (ReportEnd).
[[nodiscard]] CalibrationRun CalibrateInto(const procedure::Session& session,
                                           procedure::CalibrationRequest request);

/// Cuts the videos of recordings to the part that was read; prints on standard error which remain
/// whole, and why.
void CutRecordings(const std::vector<std::filesystem::path>& folders, const std::stop_token& stop);

/// Fits the pattern to the named printer for a dry run, or refuses it. If none is named, or it does
/// not answer, the pattern is unchanged and a message reports that. Errors: those of FitPattern and
/// CompareFacts.
[[nodiscard]] Result<void> FitForDryRun(const PrinterOptions& options, const std::stop_token& stop,
                                        files::Config& config);

/// Output of a dry run.
struct DryRun {
  bool print = true;       ///< the G-code
  bool scan = true;        ///< the sweeps
  bool for_photo = false;  ///< the print is for a photo, and no scan follows
};

/// Prints the G-code and the sweeps for `pattern`, independent of a printer.
/// Errors: kInput if the G-code would heat to an unknown temperature; kSafety if the head would
/// leave the bed of the settings.
[[nodiscard]] Result<void> PrintDryRun(pressure_advance::PatternConfig pattern,
                                       const settings::ScanSettings& settings,
                                       const DryRun& shown = {});

// Plan of the printed pattern in a photo or a scan: recorded by each command that prints one, read
// by pa photo and pa scan.

/// Start of a notice when no print of the pattern is noted, which would show whether a photo is
/// older. The printer's own screen shows it with the answer.
inline constexpr const char* kNoPrintNoted = "No print of this pattern is noted";

/// Records in the state folder, by both clocks, that a run's print begins or, of one for a photo,
/// has ended. Errors: kInput if the begin cannot be written; for an end, only a message is printed.
[[nodiscard]] Result<void> NotePrint(const procedure::Session& session,
                                     const procedure::CalibrationRequest& run, bool ended);

/// Returns the last print of the pattern for a photo on a printer. Errors: kInput: the records
/// cannot be read.
[[nodiscard]] Result<std::optional<files::PatternPrint>> LastNotedPrint(const std::string& address);

/// Reads the plan of a print. Errors: kInput: its plan no longer exists.
[[nodiscard]] Result<PhotoPlan> PlanOfPrint(const files::PatternPrint& print);

/// Pattern on a printer's bed, for commands without a plan argument.
struct LyingPattern {
  files::PatternPrint print;
  pressure_advance::PatternPlan plan;
};

/// Finds the pattern of the last print on it, for a photo or a scan. Errors (kInput): none is
/// noted; its plan no longer exists.
[[nodiscard]] Result<LyingPattern> FindLyingPattern(const std::string& address);

/// Plan found without a plan argument.
struct FoundPlan {
  PhotoPlan plan;
  std::string notice;  ///< which plan was found, for the answer
};

/// Finds the plan beside a photo, else that of the last recorded print; nothing if there is none.
/// Errors (kInput): there are several with different values; the photo is older than the print.
[[nodiscard]] Result<std::optional<FoundPlan>> FindPlanOf(const std::filesystem::path& photo);

/// Finds the plan uploaded beside the printer's photos. Errors as those of FindPlanOf; kMachine.
[[nodiscard]] Result<FoundPlan> FindUploadedPlan(const procedure::Session& session);

/// Checks that an unnamed photo can be of the last print: it is not older by the clock of the
/// printer's server, and not of another filament.
/// @param print  absent: none is noted
/// @param filament  of the photo; empty: unnamed
/// @returns a notice for the answer if the times are inconclusive; else empty.
/// Errors: kInput: it cannot.
[[nodiscard]] Result<std::string> CheckPhotoIsOf(const procedure::PatternPhoto& photo,
                                                 const std::optional<files::PatternPrint>& print,
                                                 const std::string& filament);

}  // namespace trammel::app
