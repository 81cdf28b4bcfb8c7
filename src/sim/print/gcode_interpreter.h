// Interprets G-code as a printer's firmware does: modal state in, absolute moves out.
#pragma once

#include <map>
#include <string>
#include <string_view>
#include <vector>

#include "base/result.h"

namespace trammel::sim {

struct Position {
  double x_mm = 0;
  double y_mm = 0;
  double z_mm = 0;
};

/// Straight move with the state in force when it was commanded.
struct Move {
  Position from;
  Position to;
  double e_mm = 0;                ///< filament, positive forward
  double feed_mm_s = 0;           ///< > 0; of the path, or of the filament where nothing else moves
  double acceleration_mm_s2 = 0;  ///< > 0
  double corner_velocity_mm_s = 0;
  double minimum_cruise_ratio = 0;
  double pressure_advance_s = 0;  ///< as set, even if not applied to this move
  double smooth_time_s = 0;       ///< as set
  bool stop_before = false;       ///< the planner must come to rest first (dwell, PA change)
  double dwell_before_s = 0;
};

/// Printer's state before the first command.
struct InterpreterDefaults {
  double max_velocity_mm_s = 500;
  double acceleration_mm_s2 = 3000;
  double corner_velocity_mm_s = 5;
  double minimum_cruise_ratio = 0.5;
  double smooth_time_s = 0.040;
};

struct Program {
  std::vector<Move> moves;
  std::map<std::string, int> ignored;  ///< unknown commands by name, with their count
  double hottest_nozzle_c = 0;         ///< highest nozzle temperature asked for
};

/// Interprets the Klipper commands that printing files use, and the pressure-advance commands of
/// Marlin (M900 K) and RepRapFirmware (M572 D S), both without smoothing as in those firmwares, and
/// Prusa's Buddy (M572 S W), which averages over W, 0.04 s at first. A file is Buddy's if it checks
/// the printer's model (M862.3) or sets a W.
/// Errors state the line number and the value: a malformed or non-finite number, a position beyond
/// +-10 m, a feed, acceleration or pressure advance out of bounds, more than a million moves.
[[nodiscard]] Result<Program> InterpretGcode(std::string_view text,
                                             const InterpreterDefaults& defaults);

}  // namespace trammel::sim
