// Numbers as G-code carries them: short, and the same on every machine.
#pragma once

#include <string>

namespace trammel::gcode {

/// Rounds to `decimals` places and drops trailing zeros: 1.500 -> "1.5", -0.0001 -> "0" at 3.
/// Never scientific, never "-0", independent of the locale. REQUIRES a finite value with
/// |value| < 1e12 and 0 <= decimals <= 9.
[[nodiscard]] std::string FormatNumber(double value, int decimals);

}  // namespace trammel::gcode
