#include "session/session.h"

#include <fmt/format.h>

#include <chrono>
#include <condition_variable>
#include <mutex>

#include "session/crash_recovery.h"

namespace trammel::procedure {

Result<void> KeepAlive(const Session& session) {
  constexpr double kCommand_s = 30;
  if (!session.has_limit) return {};
  const std::string owner = session.owner.empty() ? "" : " OWNER=" + session.owner;
  return session.printer.Run(kKeepAlive + owner, session.Within(kCommand_s));
}

std::string OthersJob(const machine::PrinterState& state, const std::string& own_file) {
  const bool job = state.print_state == "printing" || state.print_state == "paused";
  if (job && (own_file.empty() || state.print_file != own_file)) {
    return fmt::format("{} is {}", state.print_file, state.print_state);
  }
  return !job && state.paused ? "a job is paused" : "";
}

namespace {

Result<void> CheckReadiness(const machine::PrinterState& state) {
  if (state.readiness == machine::PrinterReadiness::kReady) return {};
  return Fail(fmt::format("the printer went to \"{}\" in the middle: {}", ToString(state.readiness),
                          machine::FirstLine(state.message)),
              ErrorKind::kMachine);
}

}  // namespace

Result<void> CheckStillFree(const Session& session) {
  constexpr double kAsk_s = 10;
  const auto state = TRY(session.printer.State(session.Within(kAsk_s)));
  TRY(CheckReadiness(state));
  const std::string job = OthersJob(state, session.own_file);
  if (job.empty()) return {};
  return Fail(fmt::format("the printer is no longer free: {}, by somebody else; begin again when "
                          "that has ended",
                          job),
              ErrorKind::kMachine);
}

Result<void> CheckStillReady(const Session& session) {
  return CheckReadiness(session.printer.LastState());
}

Result<void> CheckStillHomed(const Session& session) {
  const machine::PrinterState state = session.printer.LastState();
  TRY(CheckReadiness(state));
  for (const char axis : std::string("xyz")) {
    if (state.homed_axes.find(axis) == std::string::npos) {
      return Fail(
          fmt::format("the printer no longer knows where its {} axis is: its motors were switched "
                      "off, or it was restarted, in the middle",
                      axis),
          ErrorKind::kMachine);
    }
  }
  return {};
}

Result<void> RunNoted(const Session& session, std::string_view script, double time_limit_s) {
  if (session.note) {
    TRY(session.note(script));
  }
  return session.printer.Run(script, session.Within(time_limit_s));
}

bool Pause(double time_s, const std::stop_token& stop) {
  std::mutex mutex;
  std::condition_variable_any wake;
  std::unique_lock lock(mutex);
  wake.wait_for(lock, stop, std::chrono::duration<double>(time_s), [] { return false; });
  return !stop.stop_requested();
}

Error NameStopReason(const std::stop_token& stop, Error error) {
  if (!stop.stop_requested() || error.kind == ErrorKind::kInterrupted) return error;
  return {ErrorKind::kInterrupted,
          "stopped by the user; what failed meanwhile: " + std::move(error.message)};
}

Result<void> RefuseWhilePrinting(const Session& session, std::string_view what) {
  constexpr double kAsk_s = 10;
  const auto state = TRY(session.printer.State(session.Within(kAsk_s)));
  const bool paused = state.paused || state.print_state == "paused";
  if (!paused && state.print_state != "printing") {
    const auto owner = TRY(OwnerAtPrinter(session));
    if (owner.empty() || owner == session.owner) return {};
    return Fail(fmt::format("a run of trammel has the printer ({}) and brings back at its end what "
                            "is set now; apply {} when it has ended",
                            owner, what),
                ErrorKind::kMachine);
  }
  return Fail(fmt::format("the printer {} {}; apply {} when it has ended",
                          paused ? "is paused in" : "is printing",
                          state.print_file.empty() ? "a file" : state.print_file, what),
              ErrorKind::kMachine);
}

}  // namespace trammel::procedure
