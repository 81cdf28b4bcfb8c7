// Restores a printer after a run that died, from its journal.
#pragma once

#include <filesystem>
#include <string>

#include "base/result.h"
#include "files/new_file.h"
#include "session/print.h"
#include "session/run_journal.h"
#include "session/session.h"
#include "settings/scan_settings.h"

namespace trammel::procedure {

// Recovery of a printer from a crashed run.

/// Returns the normalised address that names a printer's journal and lock, the same for all
/// spellings.
[[nodiscard]] std::string PlainAddress(const std::string& address);

/// Returns a printer's name in results and records: "localhost:7125", the same for all spellings of
/// its address, through Moonraker's own ports or the web server in front, and without secrets.
[[nodiscard]] std::string PrinterName(const std::string& address);

/// Returns the name of a run's saved G-code state. Klipper discards it on a restart only.
[[nodiscard]] std::string GcodeStateName(const std::string& run);

/// Restores a run's saved G-code state, without a move. If the run changes tools, G-code's offset
/// remains that of the mounted tool: another tool's would be wrong by millimetres. Errors: as the
/// printer's; IsUnknownState.
[[nodiscard]] Result<void> RestoreGcodeState(const Session& session,
                                             const files::RunJournal& journal);

/// True if Klipper refuses to restore the run's G-code state because it does not know it.
[[nodiscard]] bool IsUnknownState(const std::string& message, const std::string& run);

/// Returns the run that armed the printer's own limit (klipper/trammel.cfg); empty: none.
[[nodiscard]] Result<std::string> OwnerAtPrinter(const Session& session);

/// Restores the printer after dead runs on it, from their journals: laser off, lights on, their
/// limit released, their file deleted. Restores a setting, and switches a heater off, only if it
/// still has the run's value; never G-code's offset. If there was another print since, changes
/// nothing. Reports each value that it restored or not. Does nothing without a journal. REQUIRES an
/// idle printer whose lock on this computer is held. Errors: kMachine if it could not be restored,
/// or the printer belongs to a run that may be alive; kInput if a journal cannot be removed.
[[nodiscard]] Result<void> FinishDeadRuns(const Session& session,
                                          const settings::ScanSettings& settings,
                                          const std::filesystem::path& state_folder,
                                          const std::string& address);

/// Does the same at a program's start: takes the lock itself, and skips a printer that is not
/// ready, not idle, or used by another trammel. Only reports failures.
void FinishDeadRunsWhereFree(const Session& session, const settings::ScanSettings& settings,
                             const std::filesystem::path& state_folder);

/// Cancels the print of a run that died with this printer, if it is still in progress, and lifts
/// and parks its nozzle. The print is identified by its unique file name, while nobody holds the
/// printer's lock. Call it before another print; FinishDeadRuns restores the rest. Reports its
/// actions. Errors: kMachine if the print could not be ended.
[[nodiscard]] Result<void> EndDeadPrint(const Session& session,
                                        const std::filesystem::path& state_folder,
                                        const std::string& address, const ParkPlace& park);

/// Describes the crashed run that FinishDeadRuns would find; empty if there is none. Changes
/// nothing.
[[nodiscard]] std::string DescribeDeadRun(const Session& session,
                                          const std::filesystem::path& state_folder,
                                          const std::string& address);

/// Takes the lock of a printer on this computer.
/// @param address  PlainAddress   @param holder  text shown to rejected processes
/// Errors: kMachine if another trammel has it after `wait_s`; kInput, kInterrupted.
[[nodiscard]] Result<files::FileLock> TakePrinterLock(const std::filesystem::path& state_folder,
                                                      const std::string& address,
                                                      const std::string& holder, double wait_s = 0,
                                                      const std::stop_token& stop = {});

/// Takes the printer's lock on this computer while the result lives, so that reading, recording and
/// setting are consistent; waits some seconds for another setter. Then restores the printer after a
/// dead run, which would otherwise later overwrite the new values; not during another's job.
/// @param who  name shown to others: "trammel pa apply".
/// Errors: kMachine if another trammel, which is named, keeps using the printer, or a dead run's
/// state cannot be restored; kInput, kInterrupted.
[[nodiscard]] Result<files::FileLock> TakeTurn(const Session& session,
                                               const settings::ScanSettings& settings,
                                               const std::filesystem::path& state_folder,
                                               const std::string& who);

}  // namespace trammel::procedure
