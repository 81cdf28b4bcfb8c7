#include "session/guarded_steps.h"

#include <fmt/format.h>

#include <utility>

#include "session/dead_run.h"
#include "session/name_stop.h"
#include "session/run_journal.h"

namespace trammel::procedure {
namespace {

constexpr double kAsk_s = 10;
constexpr double kHome_s = 300;

// Klipper answers calls for a moment longer than it does what they ask: where it stops or restarts
// right after a failure, that is the reason.
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

// A printer without a limit is used all the same, by somebody who knows that it has none.
void SayWhereThereIsNoLimit(const Session& session) {
  if (session.has_limit) return;
  session.Say(
      fmt::format("the printer has no {} (klipper/trammel.cfg): its heaters have no limit "
                  "of their own should this program die, so stay beside it",
                  kKeepAlive));
}

// Named at its cause, whatever failed in consequence.
Result<void> NameRestart(Result<void> done, bool restarted) {
  if (done || !restarted || done.error().kind == ErrorKind::kInterrupted) return done;
  return Fail("the printer was restarted in the middle: " + done.error().message,
              ErrorKind::kMachine);
}

// Ends what a dead run still prints, then looks at everything that can be looked at unmoved.
Result<void> Check(const Session& session, const GuardedSteps& run, const RunIdentity& identity) {
  session.Tell({.text = "checking the printer", .remaining_s = {}, .phase = "checking"});
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
  auto checked = NameStop(session.stop, Check(session, run, identity));
  if (!checked) return {checked, {}};
  auto guard = PrinterStateGuard::Take(session, *run.settings, identity);
  if (!guard) return {tl::unexpected(NameStop(session.stop, guard.error())), {}};
  guard->ParkAt(run.park);
  SayWhereThereIsNoLimit(session);
  GuardedOutcome outcome;
  outcome.done = WithReason(session, NameStop(session.stop, run.steps(session, *guard)));
  session.Tell(
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
      session.Tell({.text = "homing", .remaining_s = {}, .phase = "homing"});
      return session.printer.Run("G28", session.Within(kHome_s));
    }
  }
  return {};
}

}  // namespace trammel::procedure
