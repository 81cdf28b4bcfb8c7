// Has the printer to itself, and leaves it as it was found, whatever happens in between.
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

/// What a run is called, and where its journal goes.
struct RunIdentity {
  std::string run;      ///< unique; as files::IsRunName wants it
  std::string started;  ///< date and time, for people
  std::string address;  ///< the printer's, as in the settings
  std::filesystem::path state_folder;
  bool prints = true;            ///< a file of the run's own is uploaded
  bool without_laser = false;    ///< the run knows none: neither laser nor lights are touched
  bool may_unhome = false;       ///< its print's own end may switch the motors off
  bool heaters_end_off = false;  ///< whatever they were at: paper lies on the bed
  /// Other tools are mounted on the way, and one of them may be in the end: pressure advance comes
  /// back for its own extruder, and G-code's offset stays that of the tool that is mounted.
  bool changes_tools = false;
};

/// Notes pressure advance, velocity limits, heater targets and G-code state on disk before anything
/// is changed, and brings them back: on purpose by Restore(), or by the destructor where something
/// went wrong before. The laser goes off first. The note stays until all has come back, so that the
/// next run does it where this one dies or cannot; in the latter case the note says why.
class PrinterStateGuard {
 public:
  /// Takes the printer for this run: on this computer by a lock, at the printer by its name
  /// (_TRAMMEL_KEEP_ALIVE OWNER=…), which arms the printer's own limit. Finishes what a run left
  /// that died here. Sets the session's has_limit, owner and own_file. Errors: kMachine where the
  /// printer is busy, or another trammel has it; kInput where the note cannot be written.
  [[nodiscard]] static Result<PrinterStateGuard> Take(Session& session,
                                                      const settings::ScanSettings& settings,
                                                      const RunIdentity& identity);

  PrinterStateGuard(PrinterStateGuard&&) noexcept = default;
  PrinterStateGuard& operator=(PrinterStateGuard&&) = delete;
  ~PrinterStateGuard();

  /// Saves the G-code state under the run's name: once the printer is homed, unless the run homes
  /// it anew. Nothing else is brought back before this.
  [[nodiscard]] Result<void> Begin(const Session& session);

  /// From now on the laser may be on: where it cannot be switched off, the printer is stopped.
  void ExpectLaser() { laser_lit_ = true; }

  /// From now on a print that was not finished is left with the nozzle there.
  void ParkAt(const ParkPlace& place) { park_ = place; }

  /// Cancels the run's own print, lifts and parks its nozzle, and brings everything back once; a
  /// second call does nothing. Ignores the session's stop: a stopped calibration ends safe too.
  /// Waits `kReturn_s` for a lost connection, and begins anew where it is lost again meanwhile. A
  /// printer that was restarted keeps its heaters off, and so does a heater that somebody else
  /// switched off meanwhile; another's job is left alone with all that it
  /// may use, and the note of this run ends with it. While the run's own print cannot be ended,
  /// nothing is set. Where the laser cannot be switched off, the printer is stopped.
  /// @returns one sentence for each thing that was not brought back; empty: all is as it was.
  [[nodiscard]] std::vector<std::string> Restore();

  [[nodiscard]] const machine::PrinterState& before() const { return before_; }
  /// Known after Restore: Klipper has forgotten the run's G-code state.
  [[nodiscard]] bool restarted() const { return restarted_; }

  /// How long a lost connection or a restart may take to come back.
  static constexpr double kReturn_s = 120;

 private:
  // A script waits behind what is still queued: about 2 s of motion, or a slow sweep.
  static constexpr double kScript_s = 60;

  PrinterStateGuard(const Session& session, const settings::ScanSettings& settings,
                    const RunIdentity& identity, files::FileLock lock);

  // Shared with what notes for the session.
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
  void Say(std::string text, double remaining_s) const;

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
  bool was_free_ = false;  ///< of others' jobs, when that was last told in Restore
  bool left_ = false;      ///< to another's job, with all that it may use
  std::optional<ParkPlace> park_;
  machine::PrinterState before_;
  std::shared_ptr<Journal> journal_;
  files::FileLock lock_;
  std::vector<std::string> failed_;  ///< commands of the last attempt: another may bring them back
  std::vector<std::string> lost_;    ///< what cannot come back, or must not
};

}  // namespace trammel::procedure
