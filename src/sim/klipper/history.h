// History of a virtual printer, for tests.
#pragma once

#include <string>
#include <vector>

#include "sim/klipper/cell_probe.h"
#include "sim/klipper/motion_queue.h"

namespace trammel::sim {

/// Change of the machine. Names: "output_pin LASER", "output_pin LIGHTS", "target extruder",
/// "target heater_bed", "power extruder", "power heater_bed" (0: cut by a shutdown),
/// "pressure_advance", "smooth_time", "max_velocity", "max_accel", "square_corner_velocity",
/// "minimum_cruise_ratio", "absolute_coordinates", "absolute_extrude", "speed_factor",
/// "extrude_factor", "offset_x", "offset_y", "offset_z", "homed" (number of axes).
struct Change {
  double time_s = 0;  ///< the machine's, since its start
  std::string name;
  double value = 0;
};

/// "startup", "ready", "shutdown", "disconnected", "error", with Klipper's message.
struct StateEntry {
  double time_s = 0;
  std::string state;
  std::string message;
};

/// Move as executed: cut short if a shutdown stopped the head.
struct ExecutedMove {
  TimedMove timed;  ///< start_s on the machine's clock
};

/// Command with the time at which Klipper read it.
struct ReadLine {
  double time_s = 0;
  std::string text;
};

struct History {
  std::vector<Change> changes;
  std::vector<StateEntry> states;
  std::vector<ExecutedMove> moves;
  std::vector<ReadLine> lines;
  std::vector<ProbedTap> taps;
};

/// Returns the last value of a name at a time; `before` if it had not changed by then.
[[nodiscard]] double ValueAt(const History& history, const std::string& name, double time_s,
                             double before);

/// Returns all motion from `from_s` to `until_s` as plain absolute G-code with the settings in
/// force, which PrintGcode prints as this machine did. Omits a move in progress.
[[nodiscard]] std::string ExecutedGcode(const History& history, double from_s, double until_s);

}  // namespace trammel::sim
