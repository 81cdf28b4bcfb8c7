// NAME=NUMBER settings of `trammel sim spindle`.
#pragma once

#include <string>
#include <string_view>

#include "base/result.h"
#include "sim/spindle/spindle_camera.h"
#include "sim/spindle/spindle_world.h"

namespace trammel::app {

/// All names, for the help text.
[[nodiscard]] std::string SpindleTraitNames();

/// Sets one number of machine, clamping, part, light or eye, for example `eccentricity-mm=0.03`.
/// Errors: another form or name, not a number. Bounds are checked where the value is used.
[[nodiscard]] Result<void> SetSpindleTrait(std::string_view text, sim::SpindleSetup& setup,
                                           sim::SpindlePicture& picture);

}  // namespace trammel::app
