// Where a plan sends the virtual spindle.
#pragma once

#include <filesystem>
#include <vector>

#include "base/result.h"
#include "sim/spindle/spindle_world.h"

namespace trammel::app {

/// The places and turns of a file of observations (docs/formats.md); nothing else of it is read.
/// Errors (kInput) name the file and the place: no views, numbers that are none, a turn that is not
/// one about the spindle's own axis.
[[nodiscard]] Result<std::vector<sim::SpindleStop>> ReadSpindleStops(
    const std::filesystem::path& path, const sim::SpindleMachine& machine);

}  // namespace trammel::app
