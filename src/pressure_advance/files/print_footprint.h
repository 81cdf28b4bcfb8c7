// The footprint of a print from its G-code file.
#pragma once

#include <filesystem>

#include "base/result.h"
#include "gcode/footprint.h"

namespace trammel::files {

/// Reads what a sliced print needs of the plate, piece by piece: its size does not count in memory.
/// @param plate  REQUIRES finite bounds, min < max
/// @param low_mm  of FootprintReader
/// Errors (kInput), naming the file: not there, not readable, larger than 4 GiB, binary G-code, no
/// G-code; those of FootprintReader.
[[nodiscard]] Result<gcode::Footprint> ReadFootprint(const std::filesystem::path& path,
                                                     const gcode::PlateArea& plate, double low_mm);

}  // namespace trammel::files
