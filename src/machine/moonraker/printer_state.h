// What a printer says about itself at one moment.
#pragma once

#include <array>
#include <map>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

namespace trammel::machine {

/// Whether the firmware takes commands. kDisconnected: the server runs, but nothing behind it.
enum class PrinterReadiness { kReady, kStartup, kShutdown, kError, kDisconnected };

/// "ready", "startup", "shutdown", "error" or "disconnected".
[[nodiscard]] std::string_view ToString(PrinterReadiness readiness);

struct Heater {
  double temperature_c = 0;
  double target_c = 0;              ///< 0: off
  std::optional<bool> can_extrude;  ///< extruders only
};

/// How far the motor of an extruder or of an [extruder_stepper] runs ahead of the melt.
struct PressureAdvance {
  double advance_s = 0;
  std::optional<double> smooth_time_s;
  std::string motion_queue = {};  ///< the extruder whose filament it moves; empty: none's now

  bool operator==(const PressureAdvance&) const = default;
};

struct VelocityLimits {
  double max_velocity_mm_s = 0;
  double max_accel_mm_s2 = 0;
  std::optional<double> minimum_cruise_ratio;  ///< 0 … 1; absent in old firmware
  double square_corner_velocity_mm_s = 0;
};

/// The G-code interpreter's modes and offsets: what a script may change and has to put back.
struct GcodeModes {
  bool absolute_coordinates = true;
  bool absolute_extrude = true;
  double speed_mm_min = 0;                    ///< of the last F, before the speed factor
  double speed_factor = 1;                    ///< M220
  double extrude_factor = 1;                  ///< M221
  std::array<double, 4> homing_origin_mm{};   ///< G-code offset, x y z e
  std::array<double, 4> gcode_position_mm{};  ///< the last commanded position, x y z e
};

/// Lists are x y z e unless they say otherwise, in the printer's own coordinates. A field that the
/// printer has not told is absent, empty, or at its default where it cannot be doubted.
struct PrinterState {
  PrinterReadiness readiness = PrinterReadiness::kDisconnected;
  std::string message;     ///< the firmware's own words, for example why it shut down
  double eventtime_s = 0;  ///< when this was true, on the server's clock (see PrintClock)

  std::string homed_axes;                    ///< of "xyz"; not to be trusted unless ready
  std::array<double, 4> position_mm{};       ///< end of the last move that was planned
  std::array<double, 4> live_position_mm{};  ///< where the head is; not to be trusted unless ready
  double live_velocity_mm_s = 0;
  std::array<double, 3> axis_minimum_mm{};
  std::array<double, 3> axis_maximum_mm{};
  VelocityLimits limits;
  std::string active_extruder;  ///< "extruder", "extruder1", …
  /// Of every motor that pushes filament, by its section of the configuration: "extruder",
  /// "extruder1", "extruder_stepper belted". An extruder without a motor has none.
  std::map<std::string, PressureAdvance> pressure_advance;
  GcodeModes gcode;

  std::map<std::string, Heater> heaters;  ///< "extruder", "heater_bed", "heater_generic chamber"
  std::map<std::string, double> pins;     ///< "output_pin LASER" -> 0 … 1
  /// "led case", "neopixel hotend" -> red green blue white of each light, 0 … 1.
  std::map<std::string, std::vector<std::array<double, 4>>> lights;

  std::string print_state;    ///< "standby", "printing", "paused", "complete", "cancelled", "error"
  std::string print_file;     ///< the file being or last printed, empty where none
  std::string print_message;  ///< why a print failed
  double print_progress = 0;  ///< 0 … 1 of the file's bytes
  double print_total_s = 0;   ///< of the file being or last printed: how long it has taken
  double print_filament_mm = 0;  ///< … and how much filament its moves have asked for
  std::string idle_state;        ///< "Idle", "Ready", "Printing" (any motion)
  bool paused = false;

  /// Scripts that this client sent and whose answer it no longer waits for (a time limit or an
  /// interruption ended the wait), but which the printer has not answered yet.
  int abandoned_scripts = 0;
};

/// Of the active extruder's own motor; absent where it has none, or the printer reports none.
[[nodiscard]] std::optional<double> ActiveAdvance_s(const PrinterState& state);

/// The cause at the head of a firmware's message.
[[nodiscard]] std::string FirstLine(std::string_view message);

/// How G-code names the object of a section (EXTRUDER=, HEATER=): "belted" of
/// "extruder_stepper belted".
[[nodiscard]] std::string NameInGcode(std::string_view section);

}  // namespace trammel::machine
