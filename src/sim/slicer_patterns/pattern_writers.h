// Writers of the single tools; slicer_pattern.cc chooses one.
#pragma once

#include <span>
#include <string>
#include <string_view>

#include "sim/slicer_patterns/pattern_sketch.h"

namespace trammel::sim {

/// Each draws a whole pattern. Error (kInput): it is larger than the bed.
[[nodiscard]] Result<void> DrawOrcaLines(const PatternOptions& options,
                                         std::span<const double> values, PatternSketch& sketch);
[[nodiscard]] Result<void> DrawMarlinLines(const PatternOptions& options,
                                           std::span<const double> values, PatternSketch& sketch);
/// One pattern, or Orca's batch of them.
[[nodiscard]] Result<void> DrawChevrons(const PatternOptions& options,
                                        std::span<const double> values, PatternSketch& sketch);

/// Returns a number with this many significant digits, without trailing zeros, cut to this many
/// characters.
[[nodiscard]] std::string CutLabel(double value, int digits, std::size_t characters);
/// Returns a number rounded to this many decimals, without trailing zeros.
[[nodiscard]] std::string RoundLabel(double value, int decimals);

[[nodiscard]] Result<void> CheckOnBed(const PatternBox& box, const PatternOptions& options);

}  // namespace trammel::sim
