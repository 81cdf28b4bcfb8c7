// Sweeps the laser over printed lines and records the camera's frames.
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

// Check that the camera detects the laser: an unplugged one would be measured as noise.

/// Switches the laser on and compares pictures before and after. The laser remains on: the caller
/// switches it off, whatever the result. Errors: kMachine if the picture does not become redder,
/// with figures; those of printer and camera.
/// @returns the picture that shows it.
[[nodiscard]] Result<machine::CapturedFrame> CheckLaser(const Session& session,
                                                        FrameRecorder& recorder,
                                                        const settings::ScanSettings& settings);

/// Checks focus and exposure in the picture of the lit laser: advice if they are wrong.
[[nodiscard]] Check CheckLaserLine(const machine::CapturedFrame& lit,
                                   const settings::ScanSettings& settings);

struct ScanRequest {
  pressure_advance::PatternPlan plan;
  settings::ScanSettings settings;
  double travel_speed_mm_s = 150;
  double z_speed_mm_s = 5;
  std::filesystem::path folder;  ///< is there; holds no scan.json yet
  std::string started;           ///< date and time, for the recording
  std::string camera;            ///< camera's description of itself
  bool laser_seen = false;       ///< a scan right before has seen it, and left it on
};

/// Sweeps every line of the plan: laser on at each line, a pause at rest, the sweep at one speed, a
/// pause. Each sweep's frames are written to `folder`/lineN.avi as they arrive. After each line
/// scan.json is rewritten with the lines whose frames could be placed, so that an aborted recording
/// can be analysed. A line whose frames cannot be placed is swept again, twice at most, into
/// lineN-2.avi and lineN-3.avi; in total at most half of the lines plus one. Moves are absolute;
/// the head is at `sweeps.z_mm` after the first one. The laser remains on: the caller's
/// PrinterStateGuard switches it off. REQUIRES a homed printer with a PrinterStateGuard. Errors:
/// kMachine (printer, camera, disk, no visible laser), kMeasurement if frames and motion do not
/// match, kInterrupted.
[[nodiscard]] Result<void> ScanLines(const Session& session, FrameRecorder& recorder,
                                     const SweepPlan& sweeps, const ScanRequest& request);

}  // namespace trammel::procedure
