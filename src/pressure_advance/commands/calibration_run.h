// What the commands that print and scan have in common: one run into one folder, and its dry form.
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

/// A run of `config` into `folder`, starting now.
[[nodiscard]] procedure::CalibrationRequest RequestFor(const files::Config& config,
                                                       std::filesystem::path folder);

/// Prints on standard error what is not as it was before, and `so_far` with the folder where the
/// run failed and left something in it.
/// @returns `done`; of a run that succeeded an error (kMachine) where the printer is not as it was.
[[nodiscard]] Result<void> ReportEnd(const Result<void>& done,
                                     const std::vector<std::string>& unrestored,
                                     const std::filesystem::path& folder, const char* so_far);

struct CalibrationRun {
  Result<void> done;      ///< the recording is whole, and the printer as it was
  bool recorded = false;  ///< the recording is whole, whatever became of the printer
  double bed_c = 0;       ///< at which the bed is kept
};

/// Runs the steps, with a print noted (NotePrint), and reports their end (ReportEnd).
[[nodiscard]] CalibrationRun CalibrateInto(const procedure::Session& session,
                                           procedure::CalibrationRequest request);

/// Cuts the videos of recordings to what was read of them, and says on standard error which keep
/// their whole frames, and why.
void CutRecordings(const std::vector<std::filesystem::path>& folders, const std::stop_token& stop);

/// For a dry run: the pattern as the printer that is named would print it, or its refusal. Where
/// none is named, or it does not answer, the pattern stays as it is and that is said. Errors: those
/// of FitPattern and CompareFacts.
[[nodiscard]] Result<void> FitForDryRun(const PrinterOptions& options, const std::stop_token& stop,
                                        files::Config& config);

/// What a dry run shows.
struct DryRun {
  bool print = true;       ///< the G-code
  bool scan = true;        ///< the sweeps
  bool for_photo = false;  ///< the print is for a photo, and no scan follows
};

/// Prints the G-code and the sweeps for `pattern`, whatever a printer would say.
/// Errors: kInput where the G-code would heat to nobody knows what; kSafety where the head would
/// leave the bed of the settings.
[[nodiscard]] Result<void> PrintDryRun(pressure_advance::PatternConfig pattern,
                                       const settings::ScanSettings& settings,
                                       const DryRun& shown = {});

// The printed pattern that a photo or a scan is of: noted by whatever prints one, asked for by
// pa photo and pa scan.

/// How a notice begins where no print of the pattern is noted, which would tell whether a photo is
/// older. The printer's own screen says it with the answer.
inline constexpr const char* kNoPrintNoted = "No print of this pattern is noted";

/// Notes in the state folder that a run's print begins or, of one for a photo, has ended, by both
/// clocks. Errors: kInput of a begin, which is not written; of an end it is only said.
[[nodiscard]] Result<void> NotePrint(const procedure::Session& session,
                                     const procedure::CalibrationRequest& run, bool ended);

/// The last print of the pattern for a photo on a printer. Errors: kInput: the notes cannot be
/// read.
[[nodiscard]] Result<std::optional<files::PatternPrint>> LastNotedPrint(const std::string& address);

/// What it was printed with. Errors: kInput: its plan is not there any more.
[[nodiscard]] Result<PhotoPlan> PlanOfPrint(const files::PatternPrint& print);

/// The pattern that lies on a printer's bed, where nobody named its plan.
struct LyingPattern {
  files::PatternPrint print;
  pressure_advance::PatternPlan plan;
};

/// That of the last print on it, for a photo or a scan. Errors (kInput): none is noted; its plan is
/// not there any more.
[[nodiscard]] Result<LyingPattern> FindLyingPattern(const std::string& address);

/// A plan that nobody named.
struct FoundPlan {
  PhotoPlan plan;
  std::string notice;  ///< for the answer: which one it is
};

/// The plan that lies beside a photo; where none does, that of the last print that is noted. Errors
/// (kInput): there is none, or there are several with different values; the photo is older than the
/// print.
[[nodiscard]] Result<FoundPlan> FindPlanOf(const std::filesystem::path& photo);

/// The plan that was uploaded beside the printer's photos. Errors as those of FindPlanOf; kMachine.
[[nodiscard]] Result<FoundPlan> FindUploadedPlan(const procedure::Session& session);

/// Whether a photo that nobody named can be of the last print: it is not older by the clock of the
/// printer's server, and not for another filament.
/// @param print  absent: none is noted
/// @param filament  of the photo; empty: nobody named it
/// @returns a notice for the answer, where the times do not tell; empty: they do.
/// Errors: kInput: it cannot.
[[nodiscard]] Result<std::string> CheckPhotoIsOf(const procedure::PatternPhoto& photo,
                                                 const std::optional<files::PatternPrint>& print,
                                                 const std::string& filament);

}  // namespace trammel::app
