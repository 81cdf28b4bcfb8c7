#include "procedure/session.h"

#include <chrono>
#include <condition_variable>
#include <mutex>

namespace trammel::procedure {

Result<void> KeepAlive(const Session& session) {
  constexpr double kCommand_s = 30;
  if (!session.has_limit) return {};
  return session.printer.Run(kKeepAlive, session.Within(kCommand_s));
}

bool Pause(double time_s, const std::stop_token& stop) {
  std::mutex mutex;
  std::condition_variable_any wake;
  std::unique_lock lock(mutex);
  wake.wait_for(lock, stop, std::chrono::duration<double>(time_s), [] { return false; });
  return !stop.stop_requested();
}

}  // namespace trammel::procedure
