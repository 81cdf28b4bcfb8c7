// Journal of a run: the printer's values to restore, on disk until they are restored.
#pragma once

#include <filesystem>
#include <map>
#include <optional>
#include <set>
#include <string>
#include <string_view>

#include "base/result.h"

namespace trammel::files {

/// Printer values that G-code changes, by name. Those of a configuration section have its name
/// after a blank:
/// "max_velocity", "max_accel", "square_corner_velocity", "minimum_cruise_ratio" (mm, s);
/// "pressure_advance extruder1", "smooth_time extruder_stepper belted" (s);
/// "target heater_bed" (degC); "absolute_coordinates", "absolute_extrude" (0 or 1);
/// "speed_factor", "extrude_factor" (1: as written);
/// "offset x", "offset y", "offset z" (mm): G-code's.
using SettingValues = std::map<std::string, double>;

/// State of a printer before a run changed it, and the values that the run set.
struct RunJournal {
  std::string run;       ///< names the run everywhere: letters, digits and -, 1 … 64 of them
  std::string address;   ///< printer's address
  std::string started;   ///< date and time, for people
  std::string upload;    ///< the run's file among the printer's; empty: none
  SettingValues before;  ///< what comes back
  /// Every value that the run set per setting, recorded before it was sent.
  std::map<std::string, std::set<double>> given = {};
  /// Printer's last print when the run began, and its duration: another one shows that there was a
  /// print since.
  std::string last_print = {};
  double last_print_s = 0;
  /// True if another tool may be mounted by now; G-code's offset, which is that tool's, is not
  /// restored.
  bool changes_tools = false;
  /// True if its printer may have no laser, nor lights to switch: the run touched neither.
  bool without_laser = false;
  /// Reason why the run ended without restoring everything, as part of a sentence: "the printer was
  /// shut down (…)". Empty: it has not ended, or crashed.
  std::string ended = {};
};

[[nodiscard]] bool IsRunName(std::string_view text);

/// $XDG_STATE_HOME/trammel, else $HOME/.local/state/trammel; made where it is missing, for its user
/// alone. Errors: kInput, with what to set.
[[nodiscard]] Result<std::filesystem::path> StateFolder();

/// Returns the path of a printer's journal or lock.
[[nodiscard]] std::filesystem::path JournalPath(const std::filesystem::path& state_folder,
                                                std::string_view address);
[[nodiscard]] std::filesystem::path LockPath(const std::filesystem::path& state_folder,
                                             std::string_view address);

/// Writes the whole file to disk before it returns. Errors: kInput; nothing may be changed then.
[[nodiscard]] Result<void> WriteJournal(const std::filesystem::path& path,
                                        const RunJournal& journal);

/// Absent if there is no such file. Errors: kInput if it cannot be read or contains data that no
/// run writes.
[[nodiscard]] Result<std::optional<RunJournal>> ReadJournal(const std::filesystem::path& path);

/// Returns every readable journal, by its path; at most 100.
[[nodiscard]] std::map<std::filesystem::path, RunJournal> ReadAllJournals(
    const std::filesystem::path& state_folder);

}  // namespace trammel::files
