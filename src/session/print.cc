#include "session/print.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <chrono>
#include <cmath>

#include "session/guarded_steps.h"
#include "session/printer_settings.h"

namespace trammel::procedure {
namespace {

using machine::PrinterState;

constexpr double kCommand_s = 30;
constexpr double kUpload_s = 120;
constexpr double kReturn_s = 60;  // to reconnect; the guard then waits once more
constexpr double kNearTarget_c = 3;

double Temperature(const PrinterState& state, const std::string& heater) {
  const auto found = state.heaters.find(heater);
  return found == state.heaters.end() ? std::nan("") : found->second.temperature_c;
}

// Reports progress now and then during a wait.
class Repeatedly {
 public:
  bool Due() {
    constexpr std::chrono::seconds kEvery{10};
    const auto now = std::chrono::steady_clock::now();
    if (now - last_ < kEvery) return false;
    last_ = now;
    return true;
  }

 private:
  std::chrono::steady_clock::time_point last_ = std::chrono::steady_clock::now();
};

bool HasTarget(const PrinterState& state, const std::string& heater, double target_c) {
  const auto found = state.heaters.find(heater);
  return found != state.heaters.end() && SameValue(found->second.target_c, target_c);
}

// Checks that a heater still has the target that was set.
Result<void> CheckTarget(const Session& session, const std::string& heater, double target_c) {
  if (HasTarget(session.printer.LastState(), heater, target_c)) return {};
  // The printer's time-out reports idle once its commands have run.
  constexpr double kIdle_s = 1;
  const auto idle = session.printer.WaitUntil(
      [](const PrinterState& state) { return state.idle_state == "Idle"; },
      "the printer to be idle", session.Within(kIdle_s));
  // A restart clears the target first, and is reported a moment later.
  TRY(CheckStillReady(session));
  const auto state = session.printer.LastState();
  const auto found = state.heaters.find(heater);
  const double is_c = found == state.heaters.end() ? 0 : found->second.target_c;
  const std::string wanted = fmt::format("{} was to have {:.0f} degC", heater, target_c);
  if (is_c > 0) {
    return Fail(fmt::format("somebody set {} to {:.0f} degC in the middle ({}): begin again when "
                            "nobody else uses the printer",
                            heater, is_c, wanted),
                ErrorKind::kMachine);
  }
  return Fail(fmt::format("{} was switched off in the middle, by {} ({})", heater,
                          idle ? "the printer's own idle time-out: set [idle_timeout] timeout in "
                                 "printer.cfg to more than heating takes"
                               : "somebody's Cooldown, a macro or another client: begin again",
                          wanted),
              ErrorKind::kMachine);
}

// Sets the target, and waits until the heater has reached it, rising or falling.
Result<void> ReachTarget(const Session& session, const std::string& heater, double target_c,
                         double time_limit_s, bool cools) {
  TRY(KeepAlive(session));
  TRY(SetTarget(session, heater, target_c));
  const std::string target = fmt::format("{:.0f} degC", target_c);
  session.Report({.text = cools ? fmt::format("letting {} cool to {}", heater, target)
                                : fmt::format("heating {} to {}", heater, target),
                  .remaining_s = {},
                  .phase = cools ? "cooling" : "heating"});
  if (session.printer.LastState().heaters.count(heater) == 0) {
    return Fail(fmt::format("the printer has no heater {}", heater), ErrorKind::kMachine);
  }
  Repeatedly repeatedly;
  auto reached = session.printer.WaitUntil(
      [&](const PrinterState& state) {
        const double now_c = Temperature(state, heater);
        if (repeatedly.Due()) session.Report(fmt::format("  {} is at {:.0f} degC", heater, now_c));
        const bool near =
            cools ? now_c <= target_c + kNearTarget_c : now_c >= target_c - kNearTarget_c;
        return near || !HasTarget(state, heater, target_c) ||
               !OthersJob(state, session.own_file).empty();
      },
      fmt::format("{} to {} {}", heater, cools ? "cool to" : "reach", target),
      session.Within(time_limit_s));
  if (reached) {
    TRY(CheckStillFree(session));
    return CheckTarget(session, heater, target_c);
  }
  return Fail(fmt::format("{} (it is at {:.1f} degC)", reached.error().message,
                          Temperature(session.printer.LastState(), heater)),
              reached.error().kind);
}

// Heaters set by the file's macros are not in its text: their targets are noted when they appear.
void NoteTargets(const Session& session, const PrinterState& state) {
  if (!session.note) return;
  std::string lines;
  for (const auto& [name, heater] : state.heaters) {
    if (heater.target_c > 0) lines += TargetLine(name, heater.target_c) + "\n";
  }
  (void)session.note(lines);  // a print that runs already is not ended for it
}

// Waits until the file is no longer being printed. A print continues without us: a lost connection
// is waited for.
Result<PrinterState> WatchPrint(const Session& session, double limit_s, double filament_mm) {
  Repeatedly repeatedly;
  const auto ended = [&](const PrinterState& state) {
    if (state.print_file == session.own_file) NoteTargets(session, state);
    if (repeatedly.Due()) session.Report(ProgressOfPrint(state, filament_mm));
    return state.print_state != "printing" || state.print_file != session.own_file;
  };
  for (;;) {
    auto done =
        session.printer.WaitUntil(ended, "the pattern to be printed", session.Within(limit_s));
    const bool lost =
        !done && done.error().kind == ErrorKind::kMachine &&
        session.printer.LastState().readiness == machine::PrinterReadiness::kDisconnected;
    if (!lost) return done;
    session.Report("the connection is lost; waiting for it while the print goes on");
    TRY(session.printer.WaitUntilReady(session.Within(kReturn_s)));
  }
}

Result<void> WaitForPrint(const Session& session, const PrintOptions& options) {
  // The last print may still be shown as complete.
  TRY(session.printer.WaitUntil(
      [&](const PrinterState& state) {
        const bool ours = state.print_file == session.own_file && state.print_state != "standby";
        return ours || !OthersJob(state, session.own_file).empty();
      },
      "the print to begin", session.Within(kCommand_s)));
  const double limit_s = 3 * options.print_time_s + 2 * options.heat_time_limit_s + 120;
  const auto done = TRY(WatchPrint(session, limit_s, options.filament_mm));
  if (!OthersJob(done, session.own_file).empty()) return CheckStillFree(session);
  if (done.print_state == "complete") return {};
  if (done.print_state == "standby") {
    return Fail("the printer was restarted while it printed the pattern", ErrorKind::kMachine);
  }
  return Fail(fmt::format("the print of {} ended as \"{}\"{}{}", session.own_file, done.print_state,
                          done.print_message.empty() ? "" : ": ", done.print_message),
              ErrorKind::kMachine);
}

}  // namespace

Progress ProgressOfPrint(const PrinterState& state, double filament_mm) {
  Progress progress{.text = {}, .remaining_s = {}};
  for (const auto& [name, heater] : state.heaters) {
    if (heater.temperature_c >= heater.target_c - kNearTarget_c) continue;
    progress.text = fmt::format("  heating {}: {:.0f} of {:.0f} degC", name, heater.temperature_c,
                                heater.target_c);
  }
  const double share =
      filament_mm > 0 ? state.print_filament_mm / filament_mm : state.print_progress;
  progress.done = std::clamp(share, 0.0, 1.0);
  if (!progress.text.empty()) return progress;
  progress.text = state.print_filament_mm > 0
                      ? fmt::format("  {:.0f} % printed", 100 * *progress.done)
                      : std::string("  at the start G-code");
  return progress;
}

Result<void> SetTarget(const Session& session, const std::string& heater, double target_c) {
  TRY(CheckStillFree(session));
  return RunNoted(session, TargetLine(heater, target_c), kCommand_s);
}

Result<void> HeatAndWait(const Session& session, const std::string& heater, double target_c,
                         double time_limit_s) {
  return ReachTarget(session, heater, target_c, time_limit_s, /*cools=*/false);
}

Result<void> CoolAndWait(const Session& session, const std::string& heater, double target_c,
                         double time_limit_s) {
  return ReachTarget(session, heater, target_c, time_limit_s, /*cools=*/true);
}

Result<void> Print(const Session& session, std::string_view gcode, const PrintOptions& options) {
  session.Report({.text = "uploading the pattern", .remaining_s = {}, .phase = "uploading"});
  const std::string& name = session.own_file;
  TRY(session.printer.Upload(name, gcode, session.Within(kUpload_s)));
  if (options.bed_temperature_c > 0) {
    TRY(HeatAndWait(session, "heater_bed", options.bed_temperature_c, options.heat_time_limit_s));
  }
  if (options.nozzle_temperature_c > 0) {
    TRY(HeatAndWait(session, session.printer.LastState().active_extruder,
                    options.nozzle_temperature_c, options.heat_time_limit_s));
  }
  if (options.bed_temperature_c > 0) {
    TRY(CheckTarget(session, "heater_bed", options.bed_temperature_c));
  }
  session.Report({.text = "printing the pattern",
                  .remaining_s = options.print_time_s,
                  .phase = "printing",
                  .done = 0});
  TRY(KeepAlive(session));
  if (options.before_start) {
    TRY(options.before_start());
  }
  TRY(CheckStillFree(session));
  if (session.note) {
    TRY(session.note(gcode));
  }
  auto started = session.printer.StartPrint(name, session.Within(kCommand_s));
  return started ? WaitForPrint(session, options) : started;
}

namespace {

// Time limit of a script behind queued moves: about 2 s of motion, or a slow sweep.
constexpr double kScript_s = 60;
// Also covers a heating macro of the start code: Klipper does nothing else before its end.
constexpr double kCancel_s = 900;
constexpr double kAsk_s = 10;

// Relative, because a G-code file may have moved G-code's origin.
std::string LiftAndParkGcode(const machine::PrinterState& now, const ParkPlace& park) {
  const auto within = [&](std::size_t axis, double to_mm) {
    return std::clamp(to_mm, now.axis_minimum_mm[axis],
                      std::max(now.axis_minimum_mm[axis], now.axis_maximum_mm[axis]));
  };
  const std::array<double, 4>& at = now.position_mm;
  return fmt::format("G91\nG1 Z{:.3f} F{:.0f}\nG1 X{:.3f} Y{:.3f} F{:.0f}\nG90\nM400",
                     std::max(0.0, within(2, at[2] + park.lift_mm) - at[2]), 60 * park.z_speed_mm_s,
                     within(0, park.x_mm) - at[0], within(1, park.y_mm) - at[1],
                     60 * park.travel_speed_mm_s);
}

void LiftAndPark(const Session& session, const ParkPlace& park, EndedPrint& ended) {
  constexpr const char* kStays = "the nozzle may stand in the print, and could not be lifted: ";
  const auto now = session.printer.State({kAsk_s});
  if (!now) return ended.failed.push_back(kStays + now.error().message);
  if (auto homed = CheckStillHomed(session); !homed) {
    return ended.lost.push_back(kStays + homed.error().message);
  }
  session.Report("lifting the nozzle off the print");
  if (auto parked = session.printer.Run(LiftAndParkGcode(*now, park), {kScript_s}); !parked) {
    ended.failed.push_back("the nozzle could not be lifted off the print: " +
                           parked.error().message);
  }
}

// Without [pause_resume] there is no cancel command; closing the file ends its print, too.
Result<void> Cancel(const Session& session) {
  session.Report("cancelling the print, once the command that it is at has ended");
  const auto cancelled = session.printer.CancelPrint({kCancel_s});
  const auto now = session.printer.State({kAsk_s});
  if (!now) return cancelled;
  if (now->print_file != session.own_file || OthersJob(*now, "").empty()) return {};
  const auto closed = session.printer.Run("SDCARD_RESET_FILE", {kScript_s});
  return closed || cancelled ? closed : cancelled;
}

}  // namespace

EndedPrint EndOwnPrint(const Session& session, const machine::PrinterState& now,
                       const std::optional<ParkPlace>& park) {
  EndedPrint ended;
  if (now.print_file != session.own_file || now.print_state == "complete") return ended;
  if (now.print_state == "printing" || now.print_state == "paused") {
    if (auto cancelled = Cancel(session); !cancelled) {
      const auto then = session.printer.State({kAsk_s});
      if (then && then->readiness == machine::PrinterReadiness::kShutdown) {
        // After a shutdown Klipper reports the print as paused.
        ended.failed.push_back(DescribeShutdown(*then));
        if (park) LiftAndPark(session, *park, ended);
        return ended;
      }
      ended.failed.push_back(
          "the print could not be cancelled, so it goes on and nothing is brought back into it; "
          "cancel it at the printer: " +
          cancelled.error().message);
      return ended;
    }
  }
  if (park) LiftAndPark(session, *park, ended);
  return ended;
}

}  // namespace trammel::procedure
