// A seed names a whole virtual world: the printer, its print and the eyes that look at it.
#pragma once

#include <cstdint>
#include <optional>
#include <string_view>

#include "base/measured.h"
#include "base/random.h"
#include "base/result.h"
#include "sim/print/conditions.h"
#include "sim/print/plan_file.h"
#include "sim/print/printer.h"

namespace trammel::sim {

/// The pressure advances that a plan tests. REQUIRES a plan with lines.
[[nodiscard]] Interval TestedRange(const Plan& plan);

/// The pressure advances under which a G-code file changes its speed within a straight stroke.
/// Errors as InterpretGcode; and (kInput) a file without such strokes.
[[nodiscard]] Result<Interval> TestedRange(std::string_view gcode);

/// The truth that a world draws from the middle half of the tested range.
[[nodiscard]] double TruthOf(std::uint64_t seed, const Interval& tested_s);

/// Prints in the world of a seed. Without `k_star_s` the truth is drawn uniformly from the middle
/// half of the tested range.
/// Errors as PrintGcode; and (kInput) a truth outside 0.0001 … 10 s.
[[nodiscard]] Result<Print> PrintInWorld(std::string_view gcode, std::uint64_t seed,
                                         std::optional<double> k_star_s, const Interval& tested_s);

/// The generator of the laser eye in one condition: the same print is seen anew in each.
[[nodiscard]] Random LaserEyeOf(std::uint64_t seed, const Condition& condition);

/// The generator of the photo camera.
[[nodiscard]] Random PhotoEyeOf(std::uint64_t seed);

}  // namespace trammel::sim
