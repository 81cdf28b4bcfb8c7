#include "pressure_advance/procedure/laser_check.h"

#include <fmt/format.h>

#include <algorithm>
#include <utility>

#include "machine/net/host_clock.h"
#include "pressure_advance/laser/stripe_sight.h"
#include "pressure_advance/procedure/placed_sweep.h"
#include "pressure_advance/setup/stripe_reading.h"

namespace trammel::procedure {
namespace {

constexpr double kCommand_s = 60;
constexpr double kFrame_s = 5;

}  // namespace

Result<machine::CapturedFrame> CheckLaser(const Session& session, FrameRecorder& recorder,
                                          const settings::ScanSettings& settings) {
  const auto off = TRY(recorder.NextFrame(kFrame_s, session.stop));
  TRY(CheckStillFree(session));
  TRY(session.printer.Run(settings.laser_on_gcode, session.Within(kCommand_s)));
  TRY(session.printer.FinishMoves(session.Within(kCommand_s)));
  constexpr double kLeast = 0.0005;  // of the pixels: a line of 2 px over a quarter of the picture
  constexpr double kLate_s = 3;      // a stream may show what was some seconds ago
  const double on_s = machine::HostNow();
  double share = 0;
  do {
    auto lit = TRY(recorder.NextFrame(kFrame_s, session.stop));
    const auto redder = TRY(Reddened(off, lit));
    share = std::max(share, redder);
    if (share >= kLeast) return std::move(lit);
    TRY(CheckStillReady(session));
  } while (machine::HostNow() < on_s + kLate_s);
  return Fail(
      fmt::format("the camera does not see the laser: after {} only {:.3f} % of the picture "
                  "became redder ({:.2f} % are needed): check the laser, its command, the "
                  "camera's exposure and [camera] focus_height",
                  settings.laser_on_gcode, 100 * share, 100 * kLeast),
      ErrorKind::kMachine);
}

Check CheckLaserLine(const machine::CapturedFrame& lit, const settings::ScanSettings& settings) {
  constexpr const char* kName = "laser line";
  const auto advise = [&](std::string what) { return Check{kName, false, std::move(what), true}; };
  const auto picture = machine::DecodeFrame(lit);
  if (!picture) return advise(picture.error().message);
  vision::LaserLineWorkspace workspace;
  const bool down = pressure_advance::StripeRunsDown(picture->view());
  const auto stripe = pressure_advance::ReadStripe(picture->view(), down, workspace);
  if (!stripe.fault.empty()) return advise(stripe.fault);
  constexpr double kFullWidth = 2.35482;  // of a Gaussian at half its height, in sigmas
  const double width_px = kFullWidth * stripe.width_px;
  const pressure_advance::StripeSight sight{width_px, stripe.peak, stripe.saturated_px};
  const auto notices = pressure_advance::NoticesOfSight({&sight, 1}, settings.px_per_mm);
  if (!notices.empty()) return advise(notices.front());
  return Pass(kName, fmt::format("{:.1f} px{} wide at half its height, {:.0f} grey levels over the "
                                 "plate",
                                 width_px,
                                 settings.px_per_mm
                                     ? fmt::format(" ({:.2f} mm)", width_px / *settings.px_per_mm)
                                     : "",
                                 stripe.peak));
}

}  // namespace trammel::procedure
