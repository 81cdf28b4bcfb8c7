// Taps as tables.
#pragma once

#include <string>
#include <string_view>
#include <vector>

#include "base/result.h"
#include "tap/samples/tap.h"

namespace trammel::files {

/// Columns time, force and, where there is one, z; separated by comma, semicolon or tab. A first
/// line with names may give another order; lines that begin with # are left out. "nan" and an
/// empty field are a sample without a number.
/// @returns a tap without moves.
[[nodiscard]] Result<tap::Recording> ParseTapCsv(std::string_view text, const std::string& name);

/// Columns print_time, move_t, start_v, accel, start_z, z_r, named in the first line, in any order;
/// start_x and start_y may be there. Fills moves, x_mm and y_mm of `recording`.
[[nodiscard]] Result<void> ParseMovesCsv(std::string_view text, const std::string& name,
                                         tap::Recording& recording);

}  // namespace trammel::files
