// G-code that changes how later moves are interpreted and executed.
#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "sim/klipper/commands.h"

namespace trammel::sim {

namespace {

constexpr std::array<const char*, 4> kAxes = {"X", "Y", "Z", "E"};

Result<Outcome> Positioning(VirtualKlipper& machine, const Command& line) {
  machine.gcode.absolute = line.name == "G90";
  machine.Record("absolute_coordinates", machine.gcode.absolute ? 1 : 0);
  return Outcome{};
}

Result<Outcome> ExtruderPositioning(VirtualKlipper& machine, const Command& line) {
  machine.gcode.absolute_extrude = line.name == "M82";
  machine.Record("absolute_extrude", machine.gcode.absolute_extrude ? 1 : 0);
  return Outcome{};
}

Result<Outcome> SetOrigin(VirtualKlipper& machine, const Command& line) {
  GcodeState& state = machine.gcode;
  bool any = false;
  for (std::size_t axis = 0; axis < 4; ++axis) {
    const auto value = TRY(FloatOf(line, kAxes[axis]));
    if (!value) continue;
    any = true;
    state.base_mm[axis] =
        state.last_mm[axis] - (axis == 3 ? *value * state.extrude_factor : *value);
  }
  if (!any) state.base_mm = state.last_mm;
  return Outcome{};
}

Result<Outcome> SpeedFactor(VirtualKlipper& machine, const Command& line) {
  const auto percent = TRY(FloatOf(line, "S", {{}, 0, {}}));
  machine.gcode.speed_factor = percent.value_or(100) / 100;
  machine.Record("speed_factor", machine.gcode.speed_factor);
  return Outcome{};
}

Result<Outcome> ExtrudeFactor(VirtualKlipper& machine, const Command& line) {
  const auto percent = TRY(FloatOf(line, "S", {{}, 0, {}}));
  GcodeState& state = machine.gcode;
  const double e_value = (state.last_mm[3] - state.base_mm[3]) / state.extrude_factor;
  state.extrude_factor = percent.value_or(100) / 100;
  state.base_mm[3] = state.last_mm[3] - e_value * state.extrude_factor;
  machine.Record("extrude_factor", state.extrude_factor);
  return Outcome{};
}

Result<Outcome> GcodeOffset(VirtualKlipper& machine, const Command& line) {
  GcodeState& state = machine.gcode;
  std::array<double, 4> moved = state.last_mm;
  for (std::size_t axis = 0; axis < 4; ++axis) {
    const auto offset = TRY(FloatOf(line, kAxes[axis]));
    const auto adjust = TRY(FloatOf(line, std::string(kAxes[axis]) + "_ADJUST"));
    if (!offset && !adjust) continue;
    const double goal = offset ? *offset : state.homing_mm[axis] + *adjust;
    const double delta = goal - state.homing_mm[axis];
    moved[axis] += delta;
    state.base_mm[axis] += delta;
    state.homing_mm[axis] = goal;
    machine.Record(std::string("offset_") + static_cast<char>(std::tolower(kAxes[axis][0])), goal);
  }
  const auto move = TRY(FloatOf(line, "MOVE"));
  if (move.value_or(0) == 0) return Outcome{};
  const auto speed = TRY(FloatOf(line, "MOVE_SPEED", {{}, 0, {}}));
  state.last_mm = moved;
  return MoveTo(machine, moved, speed.value_or(state.speed_mm_s));
}

std::string StateName(const Command& line) { return line.text_of("NAME", "default"); }

Result<Outcome> SaveState(VirtualKlipper& machine, const Command& line) {
  constexpr std::size_t kMaxStates = 1000;
  if (machine.saved.size() >= kMaxStates) return Fail("Too many saved g-code states");
  machine.saved[StateName(line)] = machine.gcode;
  return Outcome{};
}

Result<Outcome> RestoreState(VirtualKlipper& machine, const Command& line) {
  const auto found = machine.saved.find(StateName(line));
  if (found == machine.saved.end()) {
    return Fail("Unknown g-code state: " + StateName(line));
  }
  const auto move = TRY(FloatOf(line, "MOVE"));
  const auto speed = TRY(FloatOf(line, "MOVE_SPEED", {{}, 0, {}}));
  const GcodeState kept = found->second;
  GcodeState& state = machine.gcode;
  const std::array<double, 4> last = state.last_mm;
  state = kept;
  state.last_mm = last;
  // Filament pushed meanwhile remains counted.
  state.base_mm[3] += last[3] - kept.last_mm[3];
  machine.Record("absolute_coordinates", state.absolute ? 1 : 0);
  machine.Record("absolute_extrude", state.absolute_extrude ? 1 : 0);
  machine.Record("speed_factor", state.speed_factor);
  machine.Record("extrude_factor", state.extrude_factor);
  if (move.value_or(0) == 0) return Outcome{};
  for (std::size_t axis = 0; axis < 3; ++axis) state.last_mm[axis] = kept.last_mm[axis];
  return MoveTo(machine, state.last_mm, speed.value_or(state.speed_mm_s));
}

Result<Outcome> VelocityLimit(VirtualKlipper& machine, const Command& line) {
  struct Limit {
    const char* key;
    const char* name;
    double* value;
    NumberRule rule;
  };
  MotionSettings& settings = machine.settings;
  const std::array<Limit, 4> limits = {{
      {"VELOCITY", "max_velocity", &settings.max_velocity_mm_s, {{}, 0, {}}},
      {"ACCEL", "max_accel", &settings.max_accel_mm_s2, {{}, 0, {}}},
      {"SQUARE_CORNER_VELOCITY",
       "square_corner_velocity",
       &settings.square_corner_velocity_mm_s,
       {0, {}, {}}},
      {"MINIMUM_CRUISE_RATIO", "minimum_cruise_ratio", &settings.minimum_cruise_ratio, {0, {}, {}}},
  }};
  std::array<std::optional<double>, 4> values;
  bool any = false;
  for (std::size_t i = 0; i < limits.size(); ++i) {
    const auto value = TRY(FloatOf(line, limits[i].key, limits[i].rule));
    values[i] = value;
    any |= value.has_value();
  }
  if (machine.config().before_2024) {
    const auto to_decel = TRY(FloatOf(line, "ACCEL_TO_DECEL", {{}, 0, {}}));
    const double most = values[1].value_or(settings.max_accel_mm_s2);
    values[3] = to_decel ? std::optional(std::max(0.0, 1 - *to_decel / most)) : std::nullopt;
  }
  if (values[3] && *values[3] >= 1) {
    return Fail(fmt::format("Error on '{}': MINIMUM_CRUISE_RATIO must be below 1.0", line.text));
  }
  for (std::size_t i = 0; i < limits.size(); ++i) {
    if (!values[i]) continue;
    *limits[i].value = *values[i];
    machine.Record(limits[i].name, *values[i]);
  }
  if (!any) {
    machine.Inform(
        fmt::format("max_velocity: {:.6f}\nmax_accel: {:.6f}\nminimum_cruise_ratio: "
                    "{:.6f}\nsquare_corner_velocity: {:.6f}",
                    settings.max_velocity_mm_s, settings.max_accel_mm_s2,
                    settings.minimum_cruise_ratio, settings.square_corner_velocity_mm_s));
  }
  return Outcome{};
}

Result<Outcome> Acceleration(VirtualKlipper& machine, const Command& line) {
  std::array<std::optional<double>, 3> values;
  const std::array<const char*, 3> keys = {"S", "P", "T"};
  for (std::size_t i = 0; i < 3; ++i) {
    const auto value = TRY(FloatOf(line, keys[i], {{}, 0, {}}));
    values[i] = value;
  }
  if (!values[0] && !(values[1] && values[2])) {
    machine.Inform(fmt::format("Invalid M204 command \"{}\"", line.text));
    return Outcome{};
  }
  machine.settings.max_accel_mm_s2 = values[0] ? *values[0] : std::min(*values[1], *values[2]);
  machine.Record("max_accel", machine.settings.max_accel_mm_s2);
  return Outcome{};
}

// Returns the section named by EXTRUDER, else the active extruder's.
Result<std::string> MotorOf(const VirtualKlipper& machine, const Command& line) {
  const auto named = line.parameters.find("EXTRUDER");
  if (named == line.parameters.end()) return machine.active_extruder;
  for (const char* kind : {"", "extruder_stepper "}) {
    if (machine.motors.contains(kind + named->second)) return kind + named->second;
  }
  return Fail(fmt::format("The value '{}' is not valid for EXTRUDER", named->second));
}

Result<Outcome> PressureAdvance(VirtualKlipper& machine, const Command& line) {
  const auto section = TRY(MotorOf(machine, line));
  const auto advance = TRY(FloatOf(line, "ADVANCE", {0, {}, {}}));
  const auto smooth = TRY(FloatOf(line, "SMOOTH_TIME", {0, {}, 0.2}));
  ExtruderMotor motor = machine.motors.at(section);
  motor.pressure_advance_s = advance.value_or(motor.pressure_advance_s);
  motor.smooth_time_s = smooth.value_or(motor.smooth_time_s);
  machine.SetMotor(section, motor);
  machine.Inform(fmt::format("pressure_advance: {:.6f}\npressure_advance_smooth_time: {:.6f}",
                             motor.pressure_advance_s, motor.smooth_time_s));
  return Outcome{};
}

Result<Outcome> SyncExtruderMotion(VirtualKlipper& machine, const Command& line) {
  const auto section = TRY(MotorOf(machine, line));
  const auto queue = line.parameters.find("MOTION_QUEUE");
  if (queue == line.parameters.end()) {
    return Fail(fmt::format("Error on '{}': missing MOTION_QUEUE", line.text));
  }
  if (!queue->second.empty() && !machine.motors.contains(queue->second)) {
    return Fail(fmt::format("'{}' is not a valid extruder.", queue->second));
  }
  machine.motors.at(section).motion_queue = queue->second;
  return Outcome{};
}

Result<Outcome> Nothing(VirtualKlipper&, const Command&) { return Outcome{}; }

}  // namespace

const std::map<std::string, Handler>& SettingCommands() {
  static const std::map<std::string, Handler> commands = {
      {"G90", Positioning},
      {"G91", Positioning},
      {"M82", ExtruderPositioning},
      {"M83", ExtruderPositioning},
      {"G92", SetOrigin},
      {"M220", SpeedFactor},
      {"M221", ExtrudeFactor},
      {"SET_GCODE_OFFSET", GcodeOffset},
      {"SAVE_GCODE_STATE", SaveState},
      {"RESTORE_GCODE_STATE", RestoreState},
      {"SET_VELOCITY_LIMIT", VelocityLimit},
      {"M204", Acceleration},
      {"SET_PRESSURE_ADVANCE", PressureAdvance},
      {"SYNC_EXTRUDER_MOTION", SyncExtruderMotion},
      {"G21", Nothing},
  };
  return commands;
}

namespace {

std::string Report(const VirtualKlipper& machine) {
  std::string text =
      fmt::format("B:{:.1f} /{:.1f} T0:{:.1f} /{:.1f}", machine.bed.temperature_c,
                  machine.bed.target_c, machine.nozzle.temperature_c, machine.nozzle.target_c);
  int tool = 0;
  for (const Heater& heater : machine.more_nozzles) {
    text += fmt::format(" T{}:{:.1f} /{:.1f}", ++tool, heater.temperature_c, heater.target_c);
  }
  return text;
}

// Waits for a condition and reports the temperatures once a second.
Wait Reporting(std::function<bool(const VirtualKlipper&)> done) {
  double next_s = -1;
  return [done = std::move(done), next_s](VirtualKlipper& machine) mutable -> Result<bool> {
    constexpr double kEveryS = 1;
    if (machine.state() != KlippyState::kReady || done(machine)) return true;
    if (machine.now_s() >= next_s) {
      next_s = machine.now_s() + kEveryS;
      machine.Respond(Report(machine));
    }
    return false;
  };
}

Result<Outcome> Heat(VirtualKlipper& machine, Heater& heater, double target_c, bool wait) {
  if (target_c != 0 && (target_c < 0 || target_c > heater.config.highest_c)) {
    return Fail(fmt::format("Requested temperature ({:.1f}) out of range ({:.1f}:{:.1f})", target_c,
                            0.0, heater.config.highest_c));
  }
  machine.SetHeaterTarget(heater, target_c);
  if (!wait || target_c == 0) return Outcome{};
  return Outcome{Reporting([&heater](const VirtualKlipper&) { return !Busy(heater); }), {}};
}

Result<Outcome> HeatByLetter(VirtualKlipper& machine, const Command& line) {
  const auto target = TRY(FloatOf(line, "S"));
  const bool nozzle = line.name == "M104" || line.name == "M109";
  const bool wait = line.name == "M109" || line.name == "M190";
  const auto tool = TRY(FloatOf(line, "T"));
  const std::string extruder = !tool        ? machine.active_extruder
                               : *tool == 0 ? "extruder"
                                            : fmt::format("extruder{:.0f}", *tool);
  Heater* heater = nozzle ? machine.FindHeater(extruder) : &machine.bed;
  if (heater == nullptr) return Fail("Extruder not configured");
  return Heat(machine, *heater, target.value_or(0), wait);
}

Result<Outcome> SetHeater(VirtualKlipper& machine, const Command& line) {
  const auto name = TRY(RequiredText(line, "HEATER"));
  Heater* heater = machine.FindHeater(name);
  if (heater == nullptr) return Fail(fmt::format("The value '{}' is not valid for HEATER", name));
  const auto target = TRY(FloatOf(line, "TARGET"));
  return Heat(machine, *heater, target.value_or(0), false);
}

Result<Outcome> HeatersOff(VirtualKlipper& machine, const Command&) {
  for (Heater* heater : machine.Heaters()) machine.SetHeaterTarget(*heater, 0);
  return Outcome{};
}

Result<Outcome> WaitForTemperature(VirtualKlipper& machine, const Command& line) {
  const auto name = TRY(RequiredText(line, "SENSOR"));
  const Heater* heater = machine.FindHeater(name);
  if (heater == nullptr) return Fail(fmt::format("Unknown sensor '{}'", name));
  const auto minimum = TRY(FloatOf(line, "MINIMUM"));
  const auto maximum = TRY(FloatOf(line, "MAXIMUM"));
  if (!minimum && !maximum) {
    return Fail("Error on 'TEMPERATURE_WAIT': missing MINIMUM or MAXIMUM.");
  }
  const double lo = minimum.value_or(-1e9);
  const double hi = maximum.value_or(1e9);
  return Outcome{Reporting([heater, lo, hi](const VirtualKlipper&) {
                   return heater->temperature_c >= lo && heater->temperature_c <= hi;
                 }),
                 {}};
}

Result<Outcome> ActivateExtruder(VirtualKlipper& machine, const Command& line) {
  const auto name = TRY(RequiredText(line, "EXTRUDER"));
  const Heater* heater = machine.FindHeater(name);
  if (heater == nullptr || heater == &machine.bed) {
    return Fail(fmt::format("The value '{}' is not valid for EXTRUDER", name));
  }
  machine.active_extruder = name;
  return Outcome{};
}

Result<Outcome> ReportTemperatures(VirtualKlipper& machine, const Command&) {
  machine.Respond(Report(machine));
  return Outcome{};
}

Result<Outcome> Fan(VirtualKlipper&, const Command& line) {
  TRY(FloatOf(line, "S", {0, {}, {}}));
  return Outcome{};
}

}  // namespace

const std::map<std::string, Handler>& HeatCommands() {
  static const std::map<std::string, Handler> commands = {
      {"M104", HeatByLetter},
      {"M109", HeatByLetter},
      {"M140", HeatByLetter},
      {"M190", HeatByLetter},
      {"SET_HEATER_TEMPERATURE", SetHeater},
      {"TURN_OFF_HEATERS", HeatersOff},
      {"TEMPERATURE_WAIT", WaitForTemperature},
      {"ACTIVATE_EXTRUDER", ActivateExtruder},
      {"M105", ReportTemperatures},
      {"M106", Fan},
      {"M107", Fan},
  };
  return commands;
}

}  // namespace trammel::sim
