// The turn of a command that sets something on a printer: one at a time on a computer.
#pragma once

#include <filesystem>
#include <string>

#include "base/result.h"
#include "files/file_lock.h"
#include "session/session.h"
#include "settings/scan_settings.h"

namespace trammel::procedure {

/// Takes the printer's lock of this computer for as long as the result lives, so that what is read,
/// noted and set belongs together; waits some seconds for another that sets something. Then ends
/// what a run left that died here (dead_run.h), which would bring back its own values later, over
/// what is set now; not while somebody's job has the printer.
/// @param who  as others are told: "trammel pa apply".
/// Errors: kMachine where another trammel stays at work with the printer, which is named, or where
/// what a dead run left cannot be brought back; kInput, kInterrupted.
[[nodiscard]] Result<files::FileLock> TakeTurn(const Session& session,
                                               const settings::ScanSettings& settings,
                                               const std::filesystem::path& state_folder,
                                               const std::string& who);

}  // namespace trammel::procedure
