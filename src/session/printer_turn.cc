#include "session/printer_turn.h"

#include <fmt/format.h>
#include <unistd.h>

#include <system_error>

#include "session/dead_run.h"
#include "session/run_journal.h"

namespace trammel::procedure {

Result<files::FileLock> TakeTurn(const Session& session, const settings::ScanSettings& settings,
                                 const std::filesystem::path& state_folder,
                                 const std::string& who) {
  constexpr double kPatience_s = 10;  // another one that sets something takes a second
  const std::string address = PlainAddress(settings.address);
  auto lock = files::FileLock::TakeWithin(
      files::LockPath(state_folder, address),
      fmt::format("{}, process {},", who, static_cast<long>(::getpid())), kPatience_s,
      session.stop);
  if (!lock && lock.error().kind == ErrorKind::kMachine) {
    return Fail(
        "another trammel on this computer is at work with this printer; wait for its end: " +
            lock.error().message,
        ErrorKind::kMachine);
  }
  if (!lock) return lock;
  std::error_code ignored;
  if (std::filesystem::exists(files::JournalPath(state_folder, address), ignored) &&
      CheckStillFree(session)) {
    TRY(FinishDeadRuns(session, settings, state_folder, address));
  }
  return lock;
}

}  // namespace trammel::procedure
