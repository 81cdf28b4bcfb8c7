#include "pressure_advance/procedure/laser_check.h"

#include <fmt/format.h>

#include <algorithm>

#include "machine/net/host_clock.h"
#include "pressure_advance/procedure/placed_sweep.h"

namespace trammel::procedure {
namespace {

constexpr double kCommand_s = 60;
constexpr double kFrame_s = 5;

}  // namespace

Result<void> CheckLaser(const Session& session, FrameRecorder& recorder,
                        const settings::ScanSettings& settings) {
  const auto off = recorder.NextFrame(kFrame_s, session.stop);
  if (!off) return tl::unexpected(off.error());
  if (auto on = session.printer.Run(settings.laser_on_gcode, session.Within(kCommand_s)); !on) {
    return on;
  }
  if (auto done = session.printer.FinishMoves(session.Within(kCommand_s)); !done) return done;
  constexpr double kLeast = 0.0005;  // of the pixels: a line of 2 px over a quarter of the picture
  constexpr double kLate_s = 3;      // a stream may show what was some seconds ago
  const double on_s = machine::HostNow();
  double share = 0;
  do {
    const auto lit = recorder.NextFrame(kFrame_s, session.stop);
    if (!lit) return tl::unexpected(lit.error());
    const auto redder = Reddened(*off, *lit);
    if (!redder) return tl::unexpected(redder.error());
    share = std::max(share, *redder);
    if (share >= kLeast) return {};
    if (auto homed = CheckStillReady(session); !homed) return homed;
  } while (machine::HostNow() < on_s + kLate_s);
  return Fail(
      fmt::format("the camera does not see the laser: after {} only {:.3f} % of the picture "
                  "became redder ({:.2f} % are needed): check the laser, its command, the "
                  "camera's exposure and [camera] focus_height",
                  settings.laser_on_gcode, 100 * share, 100 * kLeast),
      ErrorKind::kMachine);
}

}  // namespace trammel::procedure
