// Virtual printer: G-code text in, beads on a bed out.
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "base/random.h"
#include "base/result.h"
#include "sim/print/bed.h"
#include "sim/print/conditions.h"
#include "sim/print/printer_traits.h"

namespace trammel::sim {

struct Print {
  Bed bed;
  PrintTruth truth;
  std::vector<std::string> notes;  ///< ignored or suspicious input, one sentence each
};

/// Prints a G-code file: interprets it, plans its motion, drives the extruder and lays the beads.
/// The truth is K* between the slow and the fast flow of the file's own lines: the flows on either
/// side of a speed change within a straight stroke. If no stroke changes its speed, the truth is K*
/// between standstill and the most used flow, with a note.
/// Errors (kInput): text that is not G-code, numbers out of bounds (with line number and value), a
/// file that extrudes nothing, more than an hour of printing or 150 m of line.
/// Cost: about 0.1 s for the paper's pattern.
[[nodiscard]] Result<Print> PrintGcode(std::string_view gcode, const PrinterTraits& traits,
                                       Random& random);

/// Draws a world's true pressure advance: uniform within 0.015 … 0.045 s, independent of the print.
[[nodiscard]] double TruthOf(std::uint64_t seed);

/// Prints in a seed's world. Without `k_star_s` the truth is TruthOf(seed), without `exponent` the
/// storage law is the seed's; with it a power law.
/// @param flow_factor  as in PrinterTraits.
/// Errors as PrintGcode; and (kInput) a truth outside 0.0001 … 10 s, an exponent outside 0.2 … 1,
/// a flow factor out of range.
[[nodiscard]] Result<Print> PrintInWorld(std::string_view gcode, std::uint64_t seed,
                                         std::optional<double> k_star_s,
                                         std::optional<double> exponent = {},
                                         double flow_factor = 1);

/// Returns the random generator of laser and camera in one condition: each sees the same print
/// anew.
[[nodiscard]] Random LaserRandom(std::uint64_t seed, const Condition& condition);

/// Returns the random generator of the photo camera.
[[nodiscard]] Random PhotoRandom(std::uint64_t seed);

}  // namespace trammel::sim
