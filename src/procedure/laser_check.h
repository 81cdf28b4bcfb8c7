// Whether the camera sees the laser: an unplugged one would be measured as noise.
#pragma once

#include "base/result.h"
#include "pressure_advance/scan_settings.h"
#include "procedure/frame_recorder.h"
#include "procedure/session.h"

namespace trammel::procedure {

/// Switches the laser on and compares pictures before and after. Leaves it on: the caller switches
/// it off, whatever comes back. Errors: kMachine where the picture does not become redder, with
/// figures; those of printer and camera.
[[nodiscard]] Result<void> CheckLaser(const Session& session, FrameRecorder& recorder,
                                      const pressure_advance::ScanSettings& settings);

}  // namespace trammel::procedure
