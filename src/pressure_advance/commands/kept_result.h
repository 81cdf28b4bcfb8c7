// The answer of an analysis as result.json, and what it comes to when it is applied.
#pragma once

#include <filesystem>
#include <optional>
#include <string>

#include "app/config/config_file.h"
#include "app/output_files.h"
#include "base/measured.h"
#include "base/result.h"
#include "machine/moonraker/spoolman.h"
#include "measurement/outcome.h"
#include "pressure_advance/pattern/pattern.h"
#include "pressure_advance/procedure/sweep_plan.h"
#include "pressure_advance/profile/analysis.h"
#include "session/session.h"
#include "settings/scan_settings.h"

namespace trammel::app {

/// The analysis of a recording or photo as a result of this program, now.
[[nodiscard]] ResultFile ResultOf(const pressure_advance::Analysis& analysis, std::string source);

/// What was measured in a recording's folder, by the result that it keeps; empty where it keeps
/// none.
[[nodiscard]] measurement::Subject SubjectIn(const std::filesystem::path& folder);

/// A value to be set, and what it was measured as where it comes from a result.
struct ChosenValue {
  double value_s = 0;
  std::optional<Quantity> measured = {};
  std::optional<measurement::Outcome> result = {};  ///< that it stands in
  std::filesystem::path folder = {};                ///< of the recording; empty: of none
  std::optional<ResultFile> found_now = {};         ///< by an analysis that nothing keeps yet
};

/// The pressure advance of a kept result, a file or a folder's. Errors: those of
/// files::ReadOutcome; it holds none, or one beyond what a printer takes; kMeasurement where the
/// verdict is not good.
[[nodiscard]] Result<ChosenValue> KeptPressureAdvance(const std::filesystem::path& path);

// What a result is listed under.

/// Whether two names can be of one filament: one of them has to hold the other, as "PETG Jet" and
/// "Prusament PETG-Jet" do. An empty one, and one that no key can be made of, can be any.
[[nodiscard]] bool MayBeSameFilament(const std::string& a, const std::string& b);

/// Checks the name that --filament gives; an empty one is none. Errors: those of FilamentKey, with
/// the option's name.
[[nodiscard]] Result<void> CheckFilamentOption(const std::string& name);

/// The spool on the printer; none, too, where Spoolman does not tell.
/// @param wanted  standard error is told why it does not
[[nodiscard]] std::optional<machine::Spool> SpoolNow(const procedure::Session& session,
                                                     bool wanted);

/// The subject of what is measured on a printer: as told, or as the printer and Spoolman have it.
/// What cannot be asked is left empty.
/// @param filament  empty: that of the spool
[[nodiscard]] measurement::Subject SubjectOf(const std::string& filament,
                                             const procedure::Session& session,
                                             const files::Config& config,
                                             const std::optional<machine::Spool>& spool);

// How long a calibration keeps the machine, part by part, before anything moves.

/// All without heating, cooling, homing and what commands take on their way.
struct MachineTime {
  pressure_advance::PatternTime print;
  std::optional<procedure::ScanTime> scan;  ///< absent where the head cannot reach the lines

  [[nodiscard]] double total_s() const { return print.total_s() + (scan ? scan->total_s() : 0); }
};

/// What the head reaches on the bed of the settings.
[[nodiscard]] procedure::Reach BedOf(const pressure_advance::PatternConfig& pattern);

/// Of a pattern that is scanned right after it was printed. REQUIRES a valid pattern.
[[nodiscard]] MachineTime MachineTimeOf(const pressure_advance::PatternConfig& pattern,
                                        const settings::ScanSettings& settings);

/// One line each: "57 s: lines 32.2, frame 9.1, ..."
[[nodiscard]] std::string Describe(const pressure_advance::PatternTime& time);
[[nodiscard]] std::string Describe(const procedure::ScanTime& time);

}  // namespace trammel::app
