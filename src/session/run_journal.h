// The journal of a run: what has to come back on a printer, kept on disk until it has come back.
#pragma once

#include <filesystem>
#include <map>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "base/result.h"
#include "machine/moonraker/printer_state.h"

namespace trammel::files {

/// How a printer was before a run changed it.
struct RunJournal {
  std::string run;      ///< names the run everywhere: letters, digits and -, 1 … 64 of them
  std::string address;  ///< of the printer
  std::string started;  ///< date and time, for people
  std::string upload;   ///< the run's file among the printer's; empty: none
  std::optional<double> max_velocity_mm_s;
  std::optional<double> max_accel_mm_s2;
  std::optional<double> square_corner_velocity_mm_s;
  std::optional<double> minimum_cruise_ratio;
  /// Of every motor that pushes filament, by its section of the configuration.
  std::map<std::string, machine::PressureAdvance> pressure_advance;
  std::map<std::string, double> targets_c;  ///< of the heaters, by their names in the status
  /// Another tool may be mounted by now, and G-code's offset, which is that tool's, stays.
  bool changes_tools = false;
  /// Its printer may have no laser, nor lights to switch: none of both was touched.
  bool without_laser = false;
  /// Why the run ended without bringing everything back, as part of a sentence: "the printer was
  /// shut down (…)". Empty: it has not ended, or died.
  std::string ended = {};
};

/// Whether a text can name a run.
[[nodiscard]] bool IsRunName(std::string_view text);

/// $XDG_STATE_HOME/trammel, else $HOME/.local/state/trammel; made where it is missing, for its user
/// alone. Errors: kInput, with what to set.
[[nodiscard]] Result<std::filesystem::path> StateFolder();

/// Where the journal and the lock of a printer lie.
[[nodiscard]] std::filesystem::path JournalPath(const std::filesystem::path& state_folder,
                                                std::string_view address);
[[nodiscard]] std::filesystem::path LockPath(const std::filesystem::path& state_folder,
                                             std::string_view address);

/// Whole and on the disk before it returns. Errors: kInput; nothing must be changed then.
[[nodiscard]] Result<void> WriteJournal(const std::filesystem::path& path,
                                        const RunJournal& journal);

/// Absent where there is no such file. Errors: kInput where it cannot be read or holds anything
/// that no run writes.
[[nodiscard]] Result<std::optional<RunJournal>> ReadJournal(const std::filesystem::path& path);

/// Every journal that can be read, by its path; at most 100.
[[nodiscard]] std::map<std::filesystem::path, RunJournal> ReadAllJournals(
    const std::filesystem::path& state_folder);

}  // namespace trammel::files
