// Sweeps the laser over printed lines and records what the camera sees.
#pragma once

#include <filesystem>
#include <string>

#include "base/result.h"
#include "machine/camera/camera.h"
#include "pressure_advance/pattern/pattern_geometry.h"
#include "pressure_advance/procedure/plate_layout.h"
#include "pressure_advance/procedure/sweep_plan.h"
#include "session/checks.h"
#include "session/frame_recorder.h"
#include "session/session.h"
#include "settings/scan_settings.h"

namespace trammel::procedure {

// Whether the camera sees the laser: an unplugged one would be measured as noise.

/// Switches the laser on and compares pictures before and after. Leaves it on: the caller switches
/// it off, whatever comes back. Errors: kMachine where the picture does not become redder, with
/// figures; those of printer and camera.
/// @returns the picture that shows it.
[[nodiscard]] Result<machine::CapturedFrame> CheckLaser(const Session& session,
                                                        FrameRecorder& recorder,
                                                        const settings::ScanSettings& settings);

/// What the picture of the lit laser says of its focus and of the exposure: advice where it is not
/// as it should be.
[[nodiscard]] Check CheckLaserLine(const machine::CapturedFrame& lit,
                                   const settings::ScanSettings& settings);

struct ScanRequest {
  pressure_advance::PatternPlan plan;
  settings::ScanSettings settings;
  double travel_speed_mm_s = 150;
  double z_speed_mm_s = 5;
  std::filesystem::path folder;  ///< is there; holds no scan.json yet
  std::string started;           ///< date and time, for the recording
  std::string camera;            ///< what the camera says it is
  bool laser_seen = false;       ///< a scan right before has seen it, and left it on
};

/// Sweeps every line of the plan: laser on at each line, a pause standing still, the sweep at one
/// speed, a pause. Each sweep's frames go to `folder`/lineN.avi as they come, and after each line
/// scan.json is written anew with the lines whose frames could be placed, so that whatever happens
/// the recording so far can be analysed. A line whose frames
/// cannot be placed is swept again, twice at most, into lineN-2.avi and lineN-3.avi, and half of
/// the lines and one more in all. Moves are absolute; the head stands at `sweeps.z_mm` after the
/// first one. Leaves the laser on: the caller's PrinterStateGuard switches it off. REQUIRES a homed
/// printer with a PrinterStateGuard. Errors: kMachine (printer, camera, disk, no laser to be seen),
/// kMeasurement where frames and motion do not go together, kInterrupted.
[[nodiscard]] Result<void> ScanLines(const Session& session, FrameRecorder& recorder,
                                     const SweepPlan& sweeps, const ScanRequest& request);

}  // namespace trammel::procedure
