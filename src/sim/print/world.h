// A seed names a whole virtual world: the printer, its print and the eyes that look at it.
#pragma once

#include <cstdint>
#include <optional>
#include <string_view>

#include "base/random.h"
#include "base/result.h"
#include "sim/print/conditions.h"
#include "sim/print/printer.h"

namespace trammel::sim {

/// Draws a world's true pressure advance: uniform within 0.015 … 0.045 s, whatever is printed.
[[nodiscard]] double TruthOf(std::uint64_t seed);

/// Prints in the world of a seed. Without `k_star_s` the truth is TruthOf(seed).
/// Errors as PrintGcode; and (kInput) a truth outside 0.0001 … 10 s.
[[nodiscard]] Result<Print> PrintInWorld(std::string_view gcode, std::uint64_t seed,
                                         std::optional<double> k_star_s);

/// The generator of the laser eye in one condition: the same print is seen anew in each.
[[nodiscard]] Random LaserEyeOf(std::uint64_t seed, const Condition& condition);

/// The generator of the photo camera.
[[nodiscard]] Random PhotoEyeOf(std::uint64_t seed);

}  // namespace trammel::sim
