#include "session/laser_off.h"

#include <fmt/format.h>

namespace trammel::procedure {
namespace {

using machine::PrinterReadiness;

// A script waits behind what is still queued: about 2 s of motion, or a slow sweep.
constexpr double kScript_s = 60;
constexpr double kAsk_s = 10;

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
    // The pin changes where the moves before it end, 2 s later at most.
    const auto ended = lit ? session.printer.FinishMoves({kAsk_s}) : off;
    if (ended) return {};
    return {fmt::format(
        "{} waits behind motion that is still queued: look whether the laser is off: {}",
        laser_off_gcode, ended.error().message)};
  }
  const std::string& why = off.error().message;
  // Asked anew: what the printer last told by itself may be older than what just failed. A link
  // that is gone is known; behind one that is not, a printer that tells nothing has a laser all the
  // same.
  const auto now = session.printer.State({kAsk_s});
  const auto readiness = now ? now->readiness : session.printer.LastState().readiness;
  // May come back by itself, and is asked again then.
  if (readiness == PrinterReadiness::kDisconnected || readiness == PrinterReadiness::kStartup) {
    return {why};
  }
  if (now && readiness != PrinterReadiness::kReady) return {DescribeShutdown(*now)};
  // A printer whose laser was never lit is not stopped where the command waits behind another's.
  if (!lit) {
    session.Say(
        fmt::format("{} failed, and nothing was stopped for it, because this run had not "
                    "lit the laser; look whether it is off: {}",
                    laser_off_gcode, why));
    return {};
  }
  const std::string job = now ? OthersJob(*now, session.own_file) : "";
  return StopThePrinter(session, laser_off_gcode, job, why);
}

}  // namespace trammel::procedure
