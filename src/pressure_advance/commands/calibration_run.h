// What the commands that print and scan have in common: one run into one folder, and its dry form.
#pragma once

#include <filesystem>
#include <stop_token>
#include <vector>

#include "app/config/config_file.h"
#include "app/printer_session.h"
#include "base/result.h"
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

struct CalibrationRun {
  Result<void> done;      ///< the recording is whole, and the printer as it was
  bool recorded = false;  ///< the recording is whole, whatever became of the printer
  double bed_c = 0;       ///< at which the bed is kept
};

/// Runs the steps, with a print noted (NotePrint), and says on standard error what is not as it was
/// before, and where the recording so far lies.
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

}  // namespace trammel::app
