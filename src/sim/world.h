// A seed names a whole virtual world: the printer, its print and the eyes that look at it.
#pragma once

#include <cstdint>
#include <optional>
#include <string_view>

#include "base/random.h"
#include "base/result.h"
#include "sim/conditions.h"
#include "sim/printer.h"

namespace trammel::sim {

/// Prints in the world of a seed. Without `k_star_s` the truth is drawn uniformly from the middle
/// half of lowest … highest, the pressure advances that the print tests.
/// Errors as PrintGcode; and (kInput) a truth outside 0.0001 … 10 s.
[[nodiscard]] Result<Print> PrintInWorld(std::string_view gcode, std::uint64_t seed,
                                         std::optional<double> k_star_s, double lowest_s,
                                         double highest_s);

/// The generator of the laser eye in one condition: the same print is seen anew in each.
[[nodiscard]] Random LaserEyeOf(std::uint64_t seed, const Condition& condition);

/// The generator of the photo camera.
[[nodiscard]] Random PhotoEyeOf(std::uint64_t seed);

}  // namespace trammel::sim
