#include "session/own_print.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>

#include "session/laser_off.h"

namespace trammel::procedure {
namespace {

// A script waits behind what is still queued: about 2 s of motion, or a slow sweep.
constexpr double kScript_s = 60;
// Behind a macro of the start code that heats, too: Klipper does nothing else before it has ended.
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
  session.Say("lifting the nozzle off the print");
  if (auto parked = session.printer.Run(LiftAndParkGcode(*now, park), {kScript_s}); !parked) {
    ended.failed.push_back("the nozzle could not be lifted off the print: " +
                           parked.error().message);
  }
}

// Without [pause_resume] nobody knows how to cancel; closing the file ends its print, too.
Result<void> Cancel(const Session& session) {
  session.Say("cancelling the print, once the command that it is at has ended");
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
        // Klipper leaves the print of a printer that shut down as paused.
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
