// Answer of an analysis as result.json, and the value set when it is applied.
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

/// Returns the analysis of a recording or photo as a result of this program, now.
[[nodiscard]] ResultFile ResultOf(const pressure_advance::Analysis& analysis, std::string source);

/// Returns the subject in the result of a recording's folder; empty if it has no result.
[[nodiscard]] measurement::Subject SubjectIn(const std::filesystem::path& folder);

/// Value to set, with its measurement if it comes from a result.
struct ChosenValue {
  double value_s = 0;
  std::optional<Quantity> measured = {};
  std::optional<measurement::Outcome> result = {};  ///< that contains the value
  std::filesystem::path folder = {};                ///< recording's; empty: none
  std::optional<ResultFile> found_now = {};         ///< from an analysis not yet stored
};

/// Reads the pressure advance of a stored result, a file or a folder's. Errors: those of
/// files::ReadOutcome; it contains none, or one beyond a printer's range; kMeasurement if the
/// verdict is not good.
[[nodiscard]] Result<ChosenValue> KeptPressureAdvance(const std::filesystem::path& path);

// Filament names of results.

/// True if two names can be of one filament: one of them must contain the other, as "PETG Jet" and
/// "Prusament PETG-Jet" do. A name that is empty or yields no key matches any.
[[nodiscard]] bool MayBeSameFilament(const std::string& a, const std::string& b);

/// Checks the name given by --filament; an empty name counts as none. Errors: those of FilamentKey,
/// with the option's name.
[[nodiscard]] Result<void> CheckFilamentOption(const std::string& name);

/// Returns the spool on the printer; absent also if Spoolman does not answer.
/// @param wanted  prints the cause on standard error
[[nodiscard]] std::optional<machine::Spool> SpoolNow(const procedure::Session& session,
                                                     bool wanted);

/// Returns the subject of a measurement on a printer: as given, or as stored by the printer and
/// Spoolman. Unavailable fields are empty.
/// @param filament  empty: that of the spool
[[nodiscard]] measurement::Subject SubjectOf(const std::string& filament,
                                             const procedure::Session& session,
                                             const files::Config& config,
                                             const std::optional<machine::Spool>& spool);

// Machine time of a calibration, part by part, before anything moves.

/// Times without heating, cooling, homing and the latency of commands.
struct MachineTime {
  pressure_advance::PatternTime print;
  std::optional<procedure::ScanTime> scan;  ///< absent where the head cannot reach the lines

  [[nodiscard]] double total_s() const { return print.total_s() + (scan ? scan->total_s() : 0); }
};

/// Returns the reach of the head on the bed of the settings.
[[nodiscard]] procedure::Reach BedOf(const pressure_advance::PatternConfig& pattern);

/// Computes the time of a pattern that is scanned right after printing. REQUIRES a valid pattern.
[[nodiscard]] MachineTime MachineTimeOf(const pressure_advance::PatternConfig& pattern,
                                        const settings::ScanSettings& settings);

/// Describes the time in one line: "57 s: lines 32.2, frame 9.1, ..."
[[nodiscard]] std::string Describe(const pressure_advance::PatternTime& time);
[[nodiscard]] std::string Describe(const procedure::ScanTime& time);

}  // namespace trammel::app
