// Reads taps from tables.
#pragma once

#include <string>
#include <string_view>
#include <vector>

#include "base/result.h"
#include "tap/samples/tap.h"

namespace trammel::files {

/// Parses the columns time, force and, optionally, z; separated by comma, semicolon or tab. A first
/// line with names may set another order; lines that start with # are skipped. "nan" and an empty
/// field are a sample without a number.
/// @returns a tap without moves.
[[nodiscard]] Result<tap::Recording> ParseTapCsv(std::string_view text, const std::string& name);

/// Parses the columns print_time, move_t, start_v, accel, start_z, z_r, named in the first line, in
/// any order; start_x and start_y are optional. Fills moves, x_mm and y_mm of `recording`.
[[nodiscard]] Result<void> ParseMovesCsv(std::string_view text, const std::string& name,
                                         tap::Recording& recording);

}  // namespace trammel::files
