// Content of the virtual printer's printer.cfg.
#pragma once

#include <array>
#include <cstdint>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "sim/cell/cell_traits.h"

namespace trammel::sim {

/// Heater with its sensor. It rises at a rate limited by its power, settles with a time constant,
/// and cools towards room temperature.
struct HeaterConfig {
  std::string name;           ///< as in SET_HEATER_TEMPERATURE and the status
  double highest_c = 300;     ///< max_temp
  double rate_c_s = 12;       ///< fastest rise, > 0
  double settle_s = 1.5;      ///< time constant near the target, > 0
  double cool_s = 60;         ///< time constant towards the room, > 0
  double gain_window_s = 20;  ///< verify_heater's check_gain_time
  double tolerance_c = 1;     ///< M109 and M190 return within this
};

/// [output_pin NAME]; NAME as in the status, "LASER".
struct PinConfig {
  std::string name;
  double value = 0;           ///< initial
  double shutdown_value = 0;  ///< on shutdown
};

/// Argument of an action_call_remote_method: key=params.PARAMETER|default(fallback).
struct RemoteArgument {
  std::string key;
  std::string parameter;  ///< macro parameter, upper case
  std::string fallback;
  bool number = false;
};

/// Condition of a macro: a variable of another macro must have this value.
struct MacroGuard {
  std::string macro;    ///< upper case
  std::string kept;     ///< name of its variable
  std::string value;    ///< required value
  std::string because;  ///< the variable that says why not
};

/// Handling of the name of the run that has the printer, by a macro of klipper/trammel.cfg: its
/// parameter OWNER, stored in _TRAMMEL_RUN's variable owner.
enum class OwnerRule {
  kNone,
  kTake,  ///< fails where another run has the printer
  kGive   ///< does nothing at all for a run that does not have it
};

/// Handling of limits and pressure advance by a macro, as in klipper/trammel.cfg.
enum class SettingsRule { kNone, kKeep, kBringBack };

/// [gcode_macro NAME]: plain lines, and at most one call of a client.
struct MacroConfig {
  /// "{rawparams}" stands for the parameters as they were given, "{print_time}" for the end of what
  /// is queued when the macro is read, "{NAME|default}" and "{NAME|default|factor}" for a
  /// parameter.
  std::vector<std::string> lines;
  std::vector<std::string> keeps;  ///< parameters kept as its variables; those not given are not
  std::map<std::string, std::string> variables;  ///< by lower-case name; strings only
  OwnerRule owner = OwnerRule::kNone;
  SettingsRule settings = SettingsRule::kNone;
  std::optional<MacroGuard> guard;
  std::string remote_method;  ///< empty: none
  std::vector<RemoteArgument> remote_arguments;
};

/// [load_cell_probe]: the cell, how it taps, and the bed that it meets.
struct LoadCellConfig {
  CellTraits cell;
  TapMotion motion;
  double surface_z_mm = 0;  ///< of the bed at x = y = 0, where the end stop reads 0
  double tilt_x = 0;        ///< rise of the bed per mm
  double tilt_y = 0;
  double lift_speed_mm_s = 5;
  double retract_mm = 2;  ///< between the samples of one PROBE
  /// True for Klipper's forks: PROBE pulls back by itself, and reports a tap with its moves at its
  /// end. Klipper halts with the nozzle on the bed, and reports the samples until then.
  bool pulls_back = false;
  std::uint64_t seed = 0;  ///< noise seed
};

/// [tool NAME] of klipper-toolchanger.
struct ToolConfig {
  int number = 0;
  std::string name;                   ///< "tool T1"
  std::array<double, 3> offset_mm{};  ///< gcode_x_offset, gcode_y_offset, gcode_z_offset

  /// Returns its own extruder, by its number: "extruder", "extruder1", ...
  [[nodiscard]] std::string extruder() const {
    return number == 0 ? "extruder" : "extruder" + std::to_string(number);
  }
};

/// [extruder_stepper NAME]: a further motor on the filament of an extruder.
struct ExtruderStepperConfig {
  std::string name;                   ///< NAME
  std::string extruder = "extruder";  ///< followed at start; empty: none
  double pressure_advance_s = 0;
  double smooth_time_s = 0.04;
};

struct KlipperConfig {
  std::array<double, 3> axis_minimum_mm{-2, -2, -5};
  std::array<double, 3> axis_maximum_mm{255, 255, 250};
  std::array<double, 3> homing_speed_mm_s{50, 50, 10};
  std::array<double, 3> physical_start_mm{60, 40, 8};  ///< position of the unhomed head
  double max_velocity_mm_s = 500;
  double max_accel_mm_s2 = 10000;
  double max_z_velocity_mm_s = 15;
  double max_z_accel_mm_s2 = 200;
  double square_corner_velocity_mm_s = 5;
  double minimum_cruise_ratio = 0.5;
  bool before_2024 = false;  ///< max_accel_to_decel instead; MINIMUM_CRUISE_RATIO is ignored
  std::string kinematics = "cartesian";

  HeaterConfig nozzle{"extruder", 300, 12, 1.5, 60, 20, 1};
  HeaterConfig bed{"heater_bed", 130, 6, 2, 200, 60, 1};
  double room_c = 25;
  double min_extrude_temp_c = 170;
  double max_extrude_only_distance_mm = 200;
  double max_extrude_only_velocity_mm_s = 80;
  double max_extrude_only_accel_mm_s2 = 2700;
  double max_extrude_cross_section_mm2 = 5;
  double filament_diameter_mm = 1.75;
  double nozzle_diameter_mm = 0.4;
  /// Kalico's model of [extruder]: "tanh", "recipr". Empty: linear, as in Klipper.
  std::string pressure_advance_model;
  double pressure_advance_s = 0.04;
  double smooth_time_s = 0.04;

  std::vector<PinConfig> pins{{"LASER", 0, 0}, {"LIGHTS", 1, 1}};
  std::map<std::string, MacroConfig> macros;                      ///< by name, upper case
  std::map<std::string, std::vector<std::string>> delayed_gcode;  ///< by name, upper case
  double idle_timeout_s = 600;  // Klipper's own, as are the commands
  std::vector<std::string> idle_gcode{"TURN_OFF_HEATERS", "M84"};
  bool pause_resume = true;  ///< [pause_resume]: PAUSE, RESUME, CANCEL_PRINT

  std::optional<LoadCellConfig> load_cell;  ///< absent: there is no PROBE
  std::vector<ToolConfig> tools;            ///< empty: there is no klipper-toolchanger
  int extruders = 1;                        ///< [extruder], [extruder1], ...; each tool has its own
  std::vector<ExtruderStepperConfig> extruder_steppers;
  /// Further sections of printer.cfg, by name only.
  std::vector<std::string> more_sections;

  double restart_s = 2.2;  ///< from restart to ready
};

/// Returns the usual printer: macros _LASER_ON, LASER_OFF, LIGHTS_ON, LIGHTS_OFF, CALL_AGENT, and
/// those of klipper/trammel.cfg. The laser switches itself off `laser_limit_s` after _LASER_ON,
/// laser and heaters `heater_limit_s` after _TRAMMEL_KEEP_ALIVE.
[[nodiscard]] KlipperConfig DefaultKlipperConfig(double laser_limit_s = 600,
                                                 double heater_limit_s = 1800);

/// Adds the load cell's macros of klipper/trammel.cfg. _TRAMMEL_TAP probes, rises slowly and calls
/// the remote method trammel_tap. TRAMMEL_TAP_RESULT stores the answer, TRAMMEL_TAP_DONE fails if
/// that contains no contact. Without an answer it is REASON=no_answer after `answer_s`.
void AddTapMacros(KlipperConfig& config, double answer_s = 5);

/// Faults and their times. Everything is off by default. Times are the machine's, in seconds since
/// its start.
struct KlipperFaults {
  /// Number of the move with x or y (from 1) that is rejected with "Move out of range".
  std::optional<int> refuse_move;
  /// Number of the move with x or y while the laser is on (from 1) at whose reading this occurs.
  std::optional<int> shutdown_at_laser_move;
  std::optional<double> shutdown_at_s;
  std::optional<double> restart_at_s;
  /// Heater that stops rising at this temperature.
  std::string weak_heater;
  double weak_heater_c = 60;
  bool verify_heaters = true;      ///< false: Klipper never notices
  bool deaf_tools = false;         ///< SET_TOOL_PARAMETER changes nothing, as behind a macro
  bool included_tools = false;     ///< [tool]s stand where SAVE_CONFIG cannot change them
  bool printing_at_start = false;  ///< another job has the printer
  bool error_at_start = false;     ///< a config error; never ready
  double startup_s = 0;            ///< state "startup" for so long
};

/// Temperatures in °C.
struct Heater {
  HeaterConfig config;
  double temperature_c = 25;
  double target_c = 0;
  bool powered = true;           ///< false after a shutdown, whatever the target
  double highest_reach_c = 1e9;  ///< a weak heater's limit
  double watch_until_s = 0;      ///< verify_heater: by then it must have gained
  double watch_goal_c = 0;
};

/// Advances the temperature by a short time (<= 0.1 s).
void HeatFor(Heater& heater, double seconds, double room_c);

/// True if a wait for the target must continue. A target of 0 is never waited for.
[[nodiscard]] bool Busy(const Heater& heater);

/// Returns the power, 0 … 1.
[[nodiscard]] double PowerOf(const Heater& heater);

/// False once the heater rises slower than a working one; call at least every second.
[[nodiscard]] bool HeatsAsExpected(Heater& heater, double now_s);

}  // namespace trammel::sim
