// Whether the camera sees the laser: an unplugged one would be measured as noise.
#pragma once

#include "base/result.h"
#include "session/checks.h"
#include "session/frame_recorder.h"
#include "session/session.h"
#include "settings/scan_settings.h"

namespace trammel::procedure {

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

}  // namespace trammel::procedure
