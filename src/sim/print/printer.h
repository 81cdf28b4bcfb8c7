// The virtual printer: G-code text in, beads on a bed out.
#pragma once

#include <string>
#include <string_view>
#include <vector>

#include "base/random.h"
#include "base/result.h"
#include "sim/print/bed.h"
#include "sim/print/printer_traits.h"

namespace trammel::sim {

struct Print {
  Bed bed;
  PrintTruth truth;
  std::vector<std::string> notes;  ///< what was ignored or looks wrong, one sentence each
};

/// Prints a G-code file: interprets it, plans its motion, drives the extruder and lays the beads.
/// The truth is K* between the slow and the fast flow of the file's own lines: the flows on either
/// side of a speed change within a straight stroke. Where no stroke changes its speed the truth is
/// K* between standstill and the most used flow, and a note says so.
/// Errors (kInput): text that is not G-code, numbers out of bounds (with line number and value),
/// a file that extrudes nothing, more than an hour of printing or 100 m of line.
/// Cost: about 0.1 s for the paper's pattern.
[[nodiscard]] Result<Print> PrintGcode(std::string_view gcode, const PrinterTraits& traits,
                                       Random& random);

}  // namespace trammel::sim
