#include "session/guarded_steps.h"

#include <fmt/format.h>

#include <utility>

#include "session/crash_recovery.h"
#include "session/run_journal.h"
#include "session/session.h"

namespace trammel::procedure {
namespace {

constexpr double kAsk_s = 10;
constexpr double kHome_s = 300;

// Klipper answers calls slightly longer than it executes them: a stop or restart right after a
// failure is its reason.
Result<void> WithReason(const Session& session, Result<void> done) {
  constexpr double kSettle_s = 0.7;
  if (done || done.error().kind != ErrorKind::kMachine) return done;
  const auto left = session.printer.WaitUntil(
      [](const machine::PrinterState& state) {
        return state.readiness != machine::PrinterReadiness::kReady;
      },
      "the printer to settle", {kSettle_s});
  if (!left) return done;
  const std::string reason =
      fmt::format("the printer went to \"{}\" in the middle: ", ToString(left->readiness));
  if (done.error().message.starts_with(reason)) return done;
  return Fail(reason + done.error().message, ErrorKind::kMachine);
}

// A printer without a limit may be used by a user who is informed.
void ReportMissingLimit(const Session& session) {
  if (session.has_limit) return;
  session.Report(
      fmt::format("the printer has no {} (klipper/trammel.cfg): its heaters have no limit "
                  "of their own should this program die, so stay beside it",
                  kKeepAlive));
}

// Names a restart as the cause of later failures.
Result<void> NameRestart(Result<void> done, bool restarted) {
  if (done || !restarted || done.error().kind == ErrorKind::kInterrupted) return done;
  return Fail("the printer was restarted in the middle: " + done.error().message,
              ErrorKind::kMachine);
}

// Ends a dead run's print, then makes all checks that need no motion.
Result<void> Check(const Session& session, const GuardedSteps& run, const RunIdentity& identity) {
  session.Report({.text = "checking the printer", .remaining_s = {}, .phase = "checking"});
  if (identity.prints) {
    TRY(EndDeadPrint(session, identity.state_folder, identity.address, run.park));
  }
  return run.check(session);
}

}  // namespace

GuardedOutcome RunGuarded(Session& session, const GuardedSteps& run) {
  RunIdentity identity = run.identity;
  identity.address = run.settings->address;
  if (identity.state_folder.empty()) {
    auto folder = files::StateFolder();
    if (!folder) return {tl::unexpected(folder.error()), {}};
    identity.state_folder = std::move(*folder);
  }
  auto checked = NameStopReason(session.stop, Check(session, run, identity));
  if (!checked) return {checked, {}};
  auto guard = PrinterStateGuard::Take(session, *run.settings, identity);
  if (!guard) return {tl::unexpected(NameStopReason(session.stop, guard.error())), {}};
  guard->ParkAt(run.park);
  ReportMissingLimit(session);
  GuardedOutcome outcome;
  outcome.done = WithReason(session, NameStopReason(session.stop, run.steps(session, *guard)));
  session.Report(
      {.text = "bringing back what was set before", .remaining_s = {}, .phase = "restoring"});
  outcome.unrestored = guard->Restore();
  outcome.done = NameRestart(std::move(outcome.done), guard->restarted());
  return outcome;
}

Result<void> HomeWhereItIsNot(const Session& session) {
  TRY(CheckStillFree(session));
  const auto state = TRY(session.printer.State(session.Within(kAsk_s)));
  for (const char axis : std::string("xyz")) {
    if (state.homed_axes.find(axis) == std::string::npos) {
      session.Report({.text = "homing", .remaining_s = {}, .phase = "homing"});
      return session.printer.Run("G28", session.Within(kHome_s));
    }
  }
  return {};
}

namespace {

using machine::PrinterReadiness;

// Time limit of a script behind queued moves: about 2 s of motion, or a slow sweep.
constexpr double kScript_s = 60;

// @param job  of somebody else, which ends by that; empty: there is none.
std::vector<std::string> StopThePrinter(const Session& session, const std::string& laser_off_gcode,
                                        const std::string& job, const std::string& why) {
  std::vector<std::string> said = {fmt::format(
      "the laser could not be switched off by {} and the printer was stopped instead{}; "
      "it needs a FIRMWARE_RESTART: {}",
      laser_off_gcode, job.empty() ? "" : ", in the middle of somebody else's job (" + job + ")",
      why)};
  if (auto stopped = session.printer.EmergencyStop({kAsk_s}); !stopped) {
    said.push_back(
        fmt::format("the printer could not be stopped either: switch the LASER and the heaters off "
                    "by hand: {}",
                    stopped.error().message));
  }
  return said;
}

}  // namespace

std::string DescribeShutdown(const machine::PrinterState& now) {
  return fmt::format(
      "the printer has shut down: its own shutdown values hold for laser and heaters; it needs a "
      "FIRMWARE_RESTART ({})",
      machine::FirstLine(now.message));
}

std::vector<std::string> SwitchLaserOff(const Session& session, const std::string& laser_off_gcode,
                                        bool lit) {
  const auto off = session.printer.Run(laser_off_gcode, {kScript_s});
  if (off) {
    // The pin changes at the end of the moves before it, 2 s later at most.
    const auto ended = lit ? session.printer.FinishMoves({kAsk_s}) : off;
    if (ended) return {};
    return {fmt::format(
        "{} waits behind motion that is still queued: look whether the laser is off: {}",
        laser_off_gcode, ended.error().message)};
  }
  const std::string& why = off.error().message;
  // Queries again: the printer's last report may be older than the failure. A lost link is known;
  // behind an intact one the laser may be on even if the printer reports nothing.
  const auto now = session.printer.State({kAsk_s});
  const auto readiness = now ? now->readiness : session.printer.LastState().readiness;
  // May recover by itself, and is queried again then.
  if (readiness == PrinterReadiness::kDisconnected || readiness == PrinterReadiness::kStartup) {
    return {why};
  }
  if (now && readiness != PrinterReadiness::kReady) return {DescribeShutdown(*now)};
  // A printer whose laser was never lit is not stopped, since the command may only be waiting for
  // another's.
  if (!lit) {
    session.Report(
        fmt::format("{} failed, and nothing was stopped for it, because this run had not "
                    "lit the laser; look whether it is off: {}",
                    laser_off_gcode, why));
    return {};
  }
  const std::string job = now ? OthersJob(*now, session.own_file) : "";
  return StopThePrinter(session, laser_off_gcode, job, why);
}

}  // namespace trammel::procedure
