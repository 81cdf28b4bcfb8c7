// Exclusive use of the printer; its state is restored in any case.
#pragma once

#include <filesystem>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "base/result.h"
#include "files/new_file.h"
#include "machine/moonraker/printer.h"
#include "session/print.h"
#include "session/run_journal.h"
#include "session/session.h"
#include "settings/scan_settings.h"

namespace trammel::procedure {

/// Name of a run, and the folder of its journal.
struct RunIdentity {
  std::string run;      ///< unique; as files::IsRunName wants it
  std::string started;  ///< date and time, for people
  std::string address;  ///< the printer's, as in the settings
  std::filesystem::path state_folder;
  bool prints = true;            ///< a file of the run's own is uploaded
  bool without_laser = false;    ///< the run knows none: neither laser nor lights are touched
  bool may_unhome = false;       ///< true if its print's end may switch motors off
  bool heaters_end_off = false;  ///< whatever they were at: paper lies on the bed
  /// True if the run mounts other tools, and may end with another one: pressure advance is restored
  /// for its own extruder, and G-code's offset remains that of the mounted tool.
  bool changes_tools = false;
};

/// Records pressure advance, velocity limits, heater targets and G-code state on disk before any
/// change, and restores them: explicitly by Restore(), or by the destructor after a failure. The
/// laser is switched off first. The record remains until all is restored, so that the next run does
/// it if this one dies or fails; in the latter case the record states why.
class PrinterStateGuard {
 public:
  /// Claims the printer for this run: on this computer by a lock, at the printer by its name
  /// (_TRAMMEL_KEEP_ALIVE OWNER=…), which arms the printer's own limit. Restores it after a run
  /// that died here. Sets the session's has_limit, owner and own_file. Errors: kMachine if the
  /// printer is busy, or another trammel has it; kInput if the record cannot be written.
  [[nodiscard]] static Result<PrinterStateGuard> Take(Session& session,
                                                      const settings::ScanSettings& settings,
                                                      const RunIdentity& identity);

  PrinterStateGuard(PrinterStateGuard&&) noexcept = default;
  PrinterStateGuard& operator=(PrinterStateGuard&&) = delete;
  ~PrinterStateGuard();

  /// Saves the G-code state under the run's name: once the printer is homed, unless the run homes
  /// it anew. Nothing else is restored before it.
  [[nodiscard]] Result<void> Begin(const Session& session);

  /// From now on the laser may be on: if it cannot be switched off, the printer is stopped.
  void ExpectLaser() { laser_lit_ = true; }

  /// Sets the nozzle's park position after an unfinished print, from now on.
  void ParkAt(const ParkPlace& place) { park_ = place; }

  /// Cancels the run's own print, lifts and parks its nozzle, and restores everything once; a
  /// second call does nothing. Ignores the session's stop: a stopped calibration also ends safely.
  /// Waits `kReturn_s` for a lost connection, and restarts if it is lost again. Heaters remain off
  /// after a restart of the printer, and if another client switched them off. Another's job is left
  /// alone with all that it may use, and this run's record ends then. Nothing is set while the
  /// run's own print cannot be ended. If the laser cannot be switched off, the printer is stopped.
  /// @returns one sentence for each setting that was not restored; empty: all are.
  [[nodiscard]] std::vector<std::string> Restore();

  [[nodiscard]] const machine::PrinterState& before() const { return before_; }
  /// True if Klipper has lost the run's G-code state; known after Restore.
  [[nodiscard]] bool restarted() const { return restarted_; }

  /// Maximum time for a lost connection or a restart to recover.
  static constexpr double kReturn_s = 120;

 private:
  // Time limit of a script behind queued moves: about 2 s of motion, or a slow sweep.
  static constexpr double kScript_s = 60;

  PrinterStateGuard(const Session& session, const settings::ScanSettings& settings,
                    const RunIdentity& identity, files::FileLock lock);

  // Shared with the session's recorder.
  struct Journal {
    files::RunJournal run;
    std::filesystem::path path;
    bool closed = false;  // nothing is noted any more
  };

  [[nodiscard]] static Result<void> NoteGiven(Journal& journal, const machine::Printer& printer,
                                              std::string_view gcode);
  [[nodiscard]] Result<void> Note(const Session& session);
  [[nodiscard]] Result<void> Claim(const Session& session);
  void BringBack();
  void BringBackAll();
  void LeaveToOthers(const std::string& job);
  void LeaveInDoubt(const std::string& why);
  [[nodiscard]] bool EndPrint(const machine::PrinterState& now, std::string& job);
  [[nodiscard]] std::string HeatersOff();
  void BringBackSettings();
  void BringBackHeaters(bool in_doubt);
  void NoteEnd();
  void DeleteUpload();
  [[nodiscard]] Session AsSession() const;
  [[nodiscard]] std::string AnotherOwner() const;
  void Release();
  [[nodiscard]] bool RunOne(const std::string& line, double time_limit_s = kScript_s);
  void Report(std::string text, double remaining_s) const;

  struct NotOwned {
    void operator()(const machine::Printer* /*printer*/) const {}
  };

  std::unique_ptr<machine::Printer, NotOwned> printer_;  // empty once restored, or moved from
  std::function<void(const Progress&)> tell_;
  std::string laser_off_gcode_;
  std::string lights_on_gcode_;
  std::string owner_;
  std::string own_file_;
  bool has_limit_ = false;
  RunIdentity identity_;
  bool begun_ = false;
  bool laser_lit_ = false;
  bool restarted_ = false;
  bool was_free_ = false;  ///< true if no other job ran at the last report in Restore
  bool left_ = false;      ///< true if another job took over, with all that it uses
  std::optional<ParkPlace> park_;
  machine::PrinterState before_;
  std::shared_ptr<Journal> journal_;
  files::FileLock lock_;
  std::vector<std::string> failed_;  ///< commands of the last attempt: another may bring them back
  std::vector<std::string> lost_;    ///< states that cannot or must not be restored
};

}  // namespace trammel::procedure
