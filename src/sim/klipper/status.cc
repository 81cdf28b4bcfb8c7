#include "sim/klipper/status.h"

#include <fmt/format.h>

#include <algorithm>
#include <cctype>
#include <cmath>
#include <functional>
#include <map>

#include "base/text.h"
#include "sim/gcode/command.h"
#include "sim/klipper/commands.h"

namespace trammel::sim {
namespace {

using Json = nlohmann::json;

double Rounded(double value) { return std::round(value * 100) / 100; }

Json Toolhead(const VirtualKlipper& machine) {
  const KlipperConfig& config = machine.config();
  std::string homed;
  for (std::size_t axis = 0; axis < 3; ++axis) {
    if (machine.homed[axis]) homed += static_cast<char>('x' + static_cast<char>(axis));
  }
  const auto corner = [](const std::array<double, 3>& mm) {
    return Json::array({mm[0], mm[1], mm[2], 0.0});
  };
  Json status = {{"homed_axes", homed},
                 {"axis_minimum", corner(config.axis_minimum_mm)},
                 {"axis_maximum", corner(config.axis_maximum_mm)},
                 {"print_time", machine.motion().print_time_s()},
                 {"stalls", 0},
                 {"estimated_print_time", machine.PrintTimeAt(machine.clock_s())},
                 {"extruder", machine.active_extruder},
                 {"position", machine.commanded_mm},
                 {"max_velocity", machine.settings.max_velocity_mm_s},
                 {"max_accel", machine.settings.max_accel_mm_s2},
                 {"square_corner_velocity", machine.settings.square_corner_velocity_mm_s},
                 {"extra_axes", {{"extruder", 3}}}};
  const MotionSettings& settings = machine.settings;
  if (config.before_2024) {
    status["max_accel_to_decel"] = settings.max_accel_mm_s2 * (1 - settings.minimum_cruise_ratio);
  } else {
    status["minimum_cruise_ratio"] = settings.minimum_cruise_ratio;
  }
  return status;
}

Json MotionReport(const VirtualKlipper& machine) {
  const HeadState head = machine.motion().At(machine.PrintTimeAt(machine.clock_s()));
  return {
      {"live_position", {head.position.x_mm, head.position.y_mm, head.position.z_mm, head.e_mm}},
      {"live_velocity", head.speed_mm_s},
      {"live_extruder_velocity", head.filament_speed_mm_s},
      {"steppers", {"extruder", "stepper_x", "stepper_y", "stepper_z"}},
      {"trapq", {"extruder", "toolhead"}}};
}

Json HeaterStatus(const Heater& heater) {
  return {{"temperature", Rounded(heater.temperature_c)},
          {"target", heater.target_c},
          {"power", PowerOf(heater)}};
}

Json MotorStatus(const ExtruderMotor& motor) {
  return {{"pressure_advance", motor.pressure_advance_s},
          {"smooth_time", motor.smooth_time_s},
          {"motion_queue", motor.motion_queue.empty() ? Json(nullptr) : Json(motor.motion_queue)}};
}

Json ExtruderStatus(const VirtualKlipper& machine, const Heater& heater) {
  Json status = HeaterStatus(heater);
  status["can_extrude"] = heater.temperature_c >= machine.config().min_extrude_temp_c;
  status.update(MotorStatus(machine.motors.at(heater.config.name)));
  if (const std::string& model = machine.config().pressure_advance_model; !model.empty()) {
    status["pressure_advance_model"] = model;
    status["linear_advance"] = status["pressure_advance"];
    status.erase("pressure_advance");
  }
  return status;
}

Json Extruder(const VirtualKlipper& machine) { return ExtruderStatus(machine, machine.nozzle); }

Json GcodeMove(const VirtualKlipper& machine) {
  const GcodeState& state = machine.gcode;
  std::array<double, 4> shown{};
  for (std::size_t axis = 0; axis < 4; ++axis) {
    shown[axis] = state.last_mm[axis] - state.base_mm[axis];
  }
  shown[3] /= state.extrude_factor;
  return {{"speed_factor", state.speed_factor},
          {"speed", state.speed_mm_s * 60},
          {"extrude_factor", state.extrude_factor},
          {"absolute_coordinates", state.absolute},
          {"absolute_extrude", state.absolute_extrude},
          {"homing_origin", state.homing_mm},
          {"position", state.last_mm},
          {"gcode_position", shown},
          {"axis_map", {{"X", 0}, {"Y", 1}, {"Z", 2}, {"E", 3}}}};
}

Json HeaterSettings(const HeaterConfig& heater, double min_extrude_temp_c) {
  return {
      {"sensor_type", "Generic 3950"},          {"min_temp", 0.0},  {"max_temp", heater.highest_c},
      {"min_extrude_temp", min_extrude_temp_c}, {"control", "pid"}, {"pwm_cycle_time", 0.1}};
}

Json StepperSettings(const KlipperConfig& config, std::size_t axis) {
  return {{"position_endstop", 0.0},
          {"position_min", config.axis_minimum_mm[axis]},
          {"position_max", config.axis_maximum_mm[axis]},
          {"homing_speed", config.homing_speed_mm_s[axis]}};
}

Json ConfigFile(const VirtualKlipper& machine) {
  const KlipperConfig& config = machine.config();
  Json settings = {{"printer",
                    {{"kinematics", config.kinematics},
                     {"max_velocity", config.max_velocity_mm_s},
                     {"max_accel", config.max_accel_mm_s2},
                     {"minimum_cruise_ratio", config.minimum_cruise_ratio},
                     {"square_corner_velocity", config.square_corner_velocity_mm_s},
                     {"max_z_velocity", config.max_z_velocity_mm_s},
                     {"max_z_accel", config.max_z_accel_mm_s2}}},
                   {"heater_bed", HeaterSettings(config.bed, config.min_extrude_temp_c)},
                   {"extruder", HeaterSettings(config.nozzle, config.min_extrude_temp_c)},
                   {"stepper_x", StepperSettings(config, 0)},
                   {"stepper_y", StepperSettings(config, 1)},
                   {"stepper_z", StepperSettings(config, 2)},
                   {"virtual_sdcard", {{"path", "/home/pi/printer_data/gcodes"}}},
                   {"idle_timeout", {{"timeout", config.idle_timeout_s}}}};
  settings["extruder"].update({{"nozzle_diameter", config.nozzle_diameter_mm},
                               {"filament_diameter", config.filament_diameter_mm},
                               {"max_extrude_cross_section", config.max_extrude_cross_section_mm2},
                               {"max_extrude_only_distance", config.max_extrude_only_distance_mm},
                               {"max_extrude_only_velocity", config.max_extrude_only_velocity_mm_s},
                               {"max_extrude_only_accel", config.max_extrude_only_accel_mm_s2},
                               {"instantaneous_corner_velocity", 1.0},
                               {"pressure_advance", config.pressure_advance_s},
                               {"pressure_advance_smooth_time", config.smooth_time_s}});
  if (!config.pressure_advance_model.empty()) {
    settings["extruder"]["pressure_advance_model"] = config.pressure_advance_model;
  }
  for (const Heater& heater : machine.more_nozzles) {
    settings[heater.config.name] = settings["extruder"];
  }
  for (const ExtruderStepperConfig& stepper : config.extruder_steppers) {
    settings["extruder_stepper " + LowerCase(stepper.name)] = {
        {"extruder", stepper.extruder},
        {"pressure_advance", stepper.pressure_advance_s},
        {"pressure_advance_smooth_time", stepper.smooth_time_s}};
  }
  if (!config.tools.empty()) settings["toolchanger"] = Json::object();
  for (const ToolConfig& tool : config.tools) {
    settings[LowerCase(tool.name)] = {{"tool_number", tool.number}};
  }
  for (const std::string& section : config.more_sections) settings[section] = Json::object();
  if (config.pause_resume) settings["pause_resume"] = {{"recover_velocity", 50.0}};
  if (config.load_cell) {
    const LoadCellConfig& cell = *config.load_cell;
    settings["load_cell_probe"] = {
        {"sensor_type", "virtual"},
        {"sample_rate", cell.cell.converter.rate_hz},
        {"counts_per_gram", cell.cell.converter.counts_per_g},
        {"sensor_orientation", cell.cell.converter.sign < 0 ? "inverted" : "normal"},
        {"trigger_force", cell.motion.trigger_force_g},
        {"speed", cell.motion.approach_speed_mm_s},
        {"lift_speed", cell.lift_speed_mm_s},
        {"sample_retract_dist", cell.retract_mm},
        {"samples", 1},
        {"z_offset", 0.0}};
    if (cell.pulls_back) {
      settings["load_cell_probe"]["pullback_distance"] = cell.motion.pull_back_mm;
      settings["load_cell_probe"]["pullback_speed"] = cell.motion.pull_back_speed_mm_s;
    }
  }
  for (const PinConfig& pin : config.pins) {
    settings["output_pin " + LowerCase(pin.name)] = {
        {"pwm", false}, {"value", pin.value}, {"shutdown_value", pin.shutdown_value}};
  }
  for (const auto& [name, macro] : config.macros) {
    std::string gcode;
    for (const std::string& line : macro.lines) gcode += "\n" + line;
    settings["gcode_macro " + LowerCase(name)] = {{"gcode", gcode},
                                                  {"description", "G-Code macro"}};
  }
  for (const auto& [name, lines] : config.delayed_gcode) {
    std::string gcode;
    for (const std::string& line : lines) gcode += "\n" + line;
    settings["delayed_gcode " + LowerCase(name)] = {{"gcode", gcode}, {"initial_duration", 0.0}};
  }
  return {{"config", Json::object()},
          {"settings", settings},
          {"warnings", Json::array()},
          {"save_config_pending", machine.save_config_pending},
          {"save_config_pending_items", machine.pending_items}};
}

Json PrintStats(const VirtualKlipper& machine) {
  const FilePrint& print = machine.print;
  const bool begun = print.state != "standby";
  const bool going = print.state == "printing" || print.state == "paused";
  const double seconds = begun ? (going ? machine.now_s() : print.ended_s) - print.started_s : 0;
  return {{"filename", print.filename},
          {"total_duration", seconds},
          {"print_duration", seconds},
          {"filament_used", begun ? machine.commanded_mm[3] - print.e_start_mm : 0.0},
          {"state", print.state},
          {"message", print.message},
          {"info", {{"total_layer", nullptr}, {"current_layer", nullptr}}}};
}

Json VirtualSdcard(const VirtualKlipper& machine) {
  const FilePrint& print = machine.print;
  const double size = static_cast<double>(std::max<std::size_t>(1, print.size_bytes));
  return {{"file_path",
           print.loaded ? Json("/home/pi/printer_data/gcodes/" + print.filename) : Json(nullptr)},
          {"progress", static_cast<double>(print.read_bytes) / size},
          {"is_active", print.running},
          {"file_position", print.read_bytes},
          {"file_size", print.size_bytes}};
}

Json Webhooks(const VirtualKlipper& machine) {
  return {{"state", ToString(machine.state())}, {"state_message", machine.state_message()}};
}

Json IdleTimeout(const VirtualKlipper& machine) {
  const bool printing = machine.idle_state == "Printing";
  return {{"state", machine.idle_state},
          {"printing_time", printing ? machine.now_s() - machine.active_since_s : 0.0},
          {"idle_timeout", machine.config().idle_timeout_s}};
}

// G1 and M104 have no help; the others do.
bool HasHelp(const std::string& name) {
  return name.size() < 2 || !std::isdigit(static_cast<unsigned char>(name[1]));
}

// Returns every command with its help, if any.
Json Commands(const VirtualKlipper& machine) {
  Json commands = Json::object();
  for (const auto* table : CommandTables(machine)) {
    for (const auto& [name, handler] : *table) {
      commands[name] = Json::object();
      if (HasHelp(name)) commands[name]["help"] = "Command of the virtual printer";
    }
  }
  for (const ToolConfig& tool : machine.config().tools) {
    commands[fmt::format("T{}", tool.number)] = Json::object();
  }
  for (const auto& [name, macro] : machine.config().macros) {
    commands[name] = {{"help", "G-Code macro"}};
  }
  return commands;
}

Json LoadCellStatus(const VirtualKlipper& machine) {
  const CellProbe& cell = *machine.cell();
  const ConverterTraits& converter = machine.config().load_cell->cell.converter;
  Json status = {
      {"counts_per_gram", converter.counts_per_g},
      {"reference_tare_counts", std::llround(converter.offset_g * converter.counts_per_g)},
      {"tare_counts", cell.tare_counts()}};
  if (!cell.readings().empty()) status["force_g"] = cell.readings().back().force_g;
  return status;
}

Json ProbeStatus(const VirtualKlipper& machine) {
  return {{"name", "load_cell_probe"}, {"last_z_result", machine.last_probe_z_mm}};
}

/// Converts a Python literal to JSON.
Json Literal(const std::string& text) {
  if (const auto number = ToNumber(text)) return *number;
  if (text == "None") return nullptr;
  if (text == "True" || text == "False") return text == "True";
  return text.size() >= 2 ? Json(text.substr(1, text.size() - 2)) : Json(text);
}

Json ToolStatus(const VirtualKlipper& machine, const ToolConfig& tool) {
  const ToolState& state = machine.tools.at(tool.number);
  Json status = Json::object();
  for (const auto& [name, value] : state.parameters) status[name] = Literal(value);
  status.update({{"name", tool.name},
                 {"toolchanger", "toolchanger"},
                 {"tool_number", tool.number},
                 {"extruder", tool.extruder()},
                 {"heater", tool.extruder()},
                 {"extruder_stepper", nullptr},
                 {"fan", nullptr},
                 {"active", machine.active_tool == tool.number}});
  for (std::size_t axis = 0; axis < kToolOffsetNames.size(); ++axis) {
    status[kToolOffsetNames[axis]] = state.offset_mm[axis];
  }
  return status;
}

Json ToolchangerStatus(const VirtualKlipper& machine) {
  std::map<int, std::string> by_number;
  for (const ToolConfig& tool : machine.config().tools) by_number[tool.number] = tool.name;
  Json numbers = Json::array();
  Json names = Json::array();
  for (const auto& [number, name] : by_number) {
    numbers.push_back(number);
    names.push_back(name);
  }
  const int active = machine.active_tool;
  return {{"name", "toolchanger"},
          {"status", active < 0 ? "uninitialized" : "ready"},
          {"tool", active < 0 ? Json(nullptr) : Json(by_number.at(active))},
          {"tool_number", active},
          {"tool_numbers", numbers},
          {"tool_names", names}};
}

using StatusReader = std::function<Json(const VirtualKlipper&)>;

const std::map<std::string, StatusReader>& StatusReaders() {
  static const std::map<std::string, StatusReader> tellers = {
      {"gcode",
       [](const VirtualKlipper& m) {
         return Json{{"commands", Commands(m)}};
       }},
      {"webhooks", Webhooks},
      {"configfile", ConfigFile},
      {"heater_bed", [](const VirtualKlipper& m) { return HeaterStatus(m.bed); }},
      {"gcode_move", GcodeMove},
      {"save_variables",
       [](const VirtualKlipper& m) {
         Json variables = Json::object();
         for (const auto& [name, value] : m.saved_variables) variables[name] = Json::parse(value);
         return Json{{"variables", variables}};
       }},
      {"print_stats", PrintStats},
      {"virtual_sdcard", VirtualSdcard},
      {"pause_resume",
       [](const VirtualKlipper& m) {
         return Json{{"is_paused", m.print.paused}};
       }},
      {"idle_timeout", IdleTimeout},
      {"motion_report", MotionReport},
      {"toolhead", Toolhead},
      {"extruder", Extruder},
  };
  return tellers;
}

}  // namespace

Json GcodeHelp(const VirtualKlipper& machine) {
  Json help = Json::object();
  const Json commands = Commands(machine);
  for (const auto& [name, about] : commands.items()) {
    if (about.contains("help")) help[name] = about["help"];
  }
  return help;
}

std::vector<std::string> ObjectNames(const VirtualKlipper& machine) {
  std::vector<std::string> names;
  for (const auto& [name, teller] : StatusReaders()) {
    if (name != "pause_resume" || machine.config().pause_resume) names.push_back(name);
  }
  if (machine.cell() != nullptr) names.insert(names.end(), {"probe", "load_cell_probe"});
  if (!machine.tools.empty()) names.emplace_back("toolchanger");
  for (const ToolConfig& tool : machine.config().tools) names.push_back(tool.name);
  for (const Heater& heater : machine.more_nozzles) names.push_back(heater.config.name);
  for (const ExtruderStepperConfig& stepper : machine.config().extruder_steppers) {
    names.push_back("extruder_stepper " + stepper.name);
  }
  for (const PinConfig& pin : machine.config().pins) names.push_back("output_pin " + pin.name);
  for (const auto& [name, macro] : machine.config().macros) names.push_back("gcode_macro " + name);
  for (const auto& [name, lines] : machine.config().delayed_gcode) {
    names.push_back("delayed_gcode " + name);
  }
  return names;
}

Json ObjectStatus(const VirtualKlipper& machine, const std::string& name) {
  const auto teller = StatusReaders().find(name);
  if (name == "pause_resume" && !machine.config().pause_resume) return Json::object();
  if (teller != StatusReaders().end()) return teller->second(machine);
  if (machine.cell() != nullptr && name == "probe") return ProbeStatus(machine);
  if (machine.cell() != nullptr && name == "load_cell_probe") return LoadCellStatus(machine);
  if (!machine.tools.empty() && name == "toolchanger") return ToolchangerStatus(machine);
  for (const ToolConfig& tool : machine.config().tools) {
    if (name == tool.name) return ToolStatus(machine, tool);
  }
  for (const Heater& heater : machine.more_nozzles) {
    if (name == heater.config.name) return ExtruderStatus(machine, heater);
  }
  if (const auto motor = machine.motors.find(name); motor != machine.motors.end()) {
    return MotorStatus(motor->second);
  }
  for (const auto& [macro, config] : machine.config().macros) {
    if (name != "gcode_macro " + macro) continue;
    Json variables = Json::object();
    for (const auto& [variable, text] : config.variables) variables[variable] = text;
    const auto kept = machine.kept.find(macro);
    if (kept == machine.kept.end()) return variables;
    for (const auto& [variable, text] : kept->second) {
      if (config.variables.count(variable) > 0) variables[variable] = text;
    }
    return variables;
  }
  for (const auto& [pin, value] : machine.pins) {
    if (name == "output_pin " + pin) return {{"value", value}};
  }
  return Json::object();
}

}  // namespace trammel::sim
