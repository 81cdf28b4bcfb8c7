// Finishes what a run left on the printer that died before its end, by its journal.
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

// What a run that died has left on a printer, and how it is brought back.

/// The address by which journal and lock of a printer are named: the same for all ways of writing
/// it.
[[nodiscard]] std::string PlainAddress(const std::string& address);

/// A printer's name in results and notes: "localhost:7125", the same for all ways of writing its
/// address, through Moonraker's own ports or the web server before it, and without secrets.
[[nodiscard]] std::string PrinterName(const std::string& address);

/// The name of the G-code state that a run saves. Klipper forgets it with a restart, and with
/// nothing else.
[[nodiscard]] std::string GcodeStateName(const std::string& run);

/// Brings back the G-code state that a run saved, without a move. Where the run changes tools,
/// G-code's offset stays that of the tool that is mounted: another tool's would be wrong by
/// millimetres. Errors: as the printer's; SaysUnknownState.
[[nodiscard]] Result<void> RestoreGcodeState(const Session& session,
                                             const files::RunJournal& journal);

/// Whether Klipper's refusal to restore the run's G-code state says that it does not know it.
[[nodiscard]] bool SaysUnknownState(const std::string& message, const std::string& run);

/// The run by whose name the printer's own limit is armed (klipper/trammel.cfg); empty: none.
[[nodiscard]] Result<std::string> OwnerAtPrinter(const Session& session);

/// Ends what runs left that died with this printer, by their journals: laser off, lights on, their
/// limit released, their file deleted. A setting comes back, and a heater goes off, only where it
/// still has the value that the run gave it; G-code's offset never. Where something else was
/// printed since, all stays as it is. Tells each value that it brought back or left. Nothing where
/// there is no journal. REQUIRES an idle printer whose lock on this computer is held. Errors:
/// kMachine where it could not be brought back, or where the printer belongs to a run that may be
/// alive; kInput where a journal cannot be removed.
[[nodiscard]] Result<void> FinishDeadRuns(const Session& session,
                                          const settings::ScanSettings& settings,
                                          const std::filesystem::path& state_folder,
                                          const std::string& address);

/// The same at a program's start: takes the lock itself, and leaves a printer alone that is not
/// ready, not idle, or another trammel's. Failures are told.
void FinishDeadRunsWhereFree(const Session& session, const settings::ScanSettings& settings,
                             const std::filesystem::path& state_folder);

/// Cancels the print of a run that died with this printer, where it is still under way, and lifts
/// and parks its nozzle: known by the name of its file, which no other run has, while nobody holds
/// the printer's lock. To be called where another print is about to be made; FinishDeadRuns brings
/// back the rest. Tells what it did. Errors: kMachine where the print could not be ended.
[[nodiscard]] Result<void> EndDeadPrint(const Session& session,
                                        const std::filesystem::path& state_folder,
                                        const std::string& address, const ParkPlace& park);

/// What FinishDeadRuns would find, for people; empty where there is nothing. Changes nothing.
[[nodiscard]] std::string DescribeDeadRun(const Session& session,
                                          const std::filesystem::path& state_folder,
                                          const std::string& address);

/// Takes the lock of a printer on this computer.
/// @param address  PlainAddress   @param holder  as those that are refused read it
/// Errors: kMachine where another trammel has it after `wait_s`; kInput, kInterrupted.
[[nodiscard]] Result<files::FileLock> TakePrinterLock(const std::filesystem::path& state_folder,
                                                      const std::string& address,
                                                      const std::string& holder, double wait_s = 0,
                                                      const std::stop_token& stop = {});

/// Takes the printer's lock of this computer for as long as the result lives, so that what is read,
/// noted and set belongs together; waits some seconds for another that sets something. Then ends
/// what a run left that died here, which would bring back its own values later, over
/// what is set now; not while somebody's job has the printer.
/// @param who  as others are told: "trammel pa apply".
/// Errors: kMachine where another trammel stays at work with the printer, which is named, or where
/// what a dead run left cannot be brought back; kInput, kInterrupted.
[[nodiscard]] Result<files::FileLock> TakeTurn(const Session& session,
                                               const settings::ScanSettings& settings,
                                               const std::filesystem::path& state_folder,
                                               const std::string& who);

}  // namespace trammel::procedure
