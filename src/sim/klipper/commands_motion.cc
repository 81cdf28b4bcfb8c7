// G-code that moves the head.
#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <numbers>

#include "sim/klipper/commands.h"

namespace trammel::sim {
namespace {

constexpr double kHighBufferS = 2.0;  // Klipper's buffer_time_high: more than this blocks
constexpr std::array<const char*, 3> kAxes = {"X", "Y", "Z"};

std::string Place(const std::array<double, 4>& mm) {
  return fmt::format("{:.3f} {:.3f} {:.3f} [{:.3f}]", mm[0], mm[1], mm[2], mm[3]);
}

// Klipper's check of the axes used by a move.
Result<void> CheckAxes(const VirtualKlipper& machine, const std::array<double, 4>& from,
                       const std::array<double, 4>& to) {
  for (std::size_t axis = 0; axis < 3; ++axis) {
    if (to[axis] == from[axis]) continue;
    if (!machine.homed[axis]) return Fail("Must home axis first: " + Place(to));
    if (to[axis] < machine.config().axis_minimum_mm[axis] ||
        to[axis] > machine.config().axis_maximum_mm[axis]) {
      return Fail("Move out of range: " + Place(to));
    }
  }
  return {};
}

Result<void> CheckFilament(const VirtualKlipper& machine, double path_mm, bool in_plane,
                           double e_mm) {
  const KlipperConfig& config = machine.config();
  if (e_mm == 0) return {};
  if (machine.ActiveNozzle().temperature_c < config.min_extrude_temp_c) {
    return Fail("Extrude below minimum temp\nSee the 'min_extrude_temp' config option for details");
  }
  const double area_mm2 =
      std::numbers::pi / 4 * config.filament_diameter_mm * config.filament_diameter_mm;
  if (!in_plane || e_mm < 0) {
    if (std::abs(e_mm) > config.max_extrude_only_distance_mm) {
      return Fail(
          fmt::format("Extrude only move too long ({:.3f}mm vs {:.3f}mm)\nSee the "
                      "'max_extrude_only_distance' config option for details",
                      e_mm, config.max_extrude_only_distance_mm));
    }
  } else if (e_mm / path_mm * area_mm2 > config.max_extrude_cross_section_mm2) {
    return Fail(
        fmt::format("Move exceeds maximum extrusion ({:.3f}mm^2 vs {:.3f}mm^2)\nSee the "
                    "'max_extrude_cross_section' config option for details",
                    e_mm / path_mm * area_mm2, config.max_extrude_cross_section_mm2));
  }
  return {};
}

// Triggers faults that wait for a move; true if the move is to be rejected.
Result<bool> MoveFault(VirtualKlipper& machine, bool in_plane) {
  if (!in_plane) return false;
  const KlipperFaults& faults = machine.faults();
  ++machine.xy_moves;
  const auto laser = machine.pins.find("LASER");
  const bool lit = laser != machine.pins.end() && laser->second > 0;
  if (lit) ++machine.laser_moves;
  if (lit && machine.laser_moves == faults.shutdown_at_laser_move.value_or(-1)) {
    machine.Shutdown("MCU 'mcu' shutdown: Timer too close");
    return Fail(machine.state_message());
  }
  return machine.xy_moves == faults.refuse_move.value_or(-1);
}

Outcome WaitForRoom() {
  return {[](VirtualKlipper& machine) -> Result<bool> {
            return machine.motion().print_time_s() - machine.print_now_s() <= kHighBufferS;
          },
          {}};
}

// Returns the move with the limits of its axes. Klipper limits moves in z and of filament alone.
Move Limited(const VirtualKlipper& machine, const std::array<double, 4>& from,
             const std::array<double, 4>& to, double speed_mm_s, double path_mm) {
  const KlipperConfig& config = machine.config();
  const MotionSettings& settings = machine.settings;
  Move move;
  move.from = {from[0], from[1], from[2]};
  move.to = {to[0], to[1], to[2]};
  move.e_mm = to[3] - from[3];
  move.feed_mm_s = std::min(speed_mm_s, settings.max_velocity_mm_s);
  move.acceleration_mm_s2 = settings.max_accel_mm_s2;
  move.corner_velocity_mm_s = settings.square_corner_velocity_mm_s;
  move.minimum_cruise_ratio = settings.minimum_cruise_ratio;
  move.pressure_advance_s = machine.ActiveMotor().pressure_advance_s;
  move.smooth_time_s = machine.ActiveMotor().smooth_time_s;
  const double z_mm = std::abs(to[2] - from[2]);
  if (path_mm <= 1e-9) {
    move.feed_mm_s = std::min(speed_mm_s, config.max_extrude_only_velocity_mm_s);
    move.acceleration_mm_s2 = config.max_extrude_only_accel_mm_s2;
  } else if (z_mm > 0) {
    const double ratio = path_mm / z_mm;
    move.feed_mm_s = std::min(move.feed_mm_s, config.max_z_velocity_mm_s * ratio);
    move.acceleration_mm_s2 = std::min(move.acceleration_mm_s2, config.max_z_accel_mm_s2 * ratio);
  }
  return move;
}

}  // namespace

Outcome WaitForMoves(VirtualKlipper& machine) {
  machine.motion().Flush(machine.print_now_s());
  return {[](VirtualKlipper& m) -> Result<bool> {
            return m.print_now_s() >= m.motion().print_time_s();
          },
          {}};
}

Result<Outcome> MoveTo(VirtualKlipper& machine, const std::array<double, 4>& to_mm,
                       double speed_mm_s) {
  const std::array<double, 4> from = machine.commanded_mm;
  const bool in_plane = to_mm[0] != from[0] || to_mm[1] != from[1];
  const double path_mm = std::hypot(to_mm[0] - from[0], to_mm[1] - from[1], to_mm[2] - from[2]);
  const bool refused = TRY(MoveFault(machine, in_plane));
  if (refused) return Fail("Move out of range: " + Place(to_mm));
  TRY(CheckAxes(machine, from, to_mm));
  TRY(CheckFilament(machine, path_mm, in_plane, to_mm[3] - from[3]));
  const Move move = Limited(machine, from, to_mm, speed_mm_s, path_mm);
  machine.commanded_mm = to_mm;
  if (!HasMotion(move)) return Outcome{};
  machine.motion().Append(move, machine.print_now_s());
  return WaitForRoom();
}

namespace {

Result<Outcome> Move_(VirtualKlipper& machine, const Command& line) {
  GcodeState& state = machine.gcode;
  for (std::size_t axis = 0; axis < 4; ++axis) {
    const auto found = line.parameters.find(axis == 3 ? "E" : kAxes[axis]);
    if (found == line.parameters.end()) continue;
    const std::optional<double> value = ToNumber(found->second);
    constexpr double kFarMm = 1e7;
    if (!value || std::abs(*value) > kFarMm) {
      return Fail(fmt::format("Unable to parse move '{}'", line.text));
    }
    const bool absolute = axis == 3 ? state.absolute && state.absolute_extrude : state.absolute;
    const double scaled = axis == 3 ? *value * state.extrude_factor : *value;
    state.last_mm[axis] = absolute ? scaled + state.base_mm[axis] : state.last_mm[axis] + scaled;
  }
  if (line.has("F")) {
    const std::optional<double> feed = ToNumber(line.parameters.at("F"));
    if (!feed) return Fail(fmt::format("Unable to parse move '{}'", line.text));
    if (*feed <= 0) return Fail(fmt::format("Invalid speed in '{}'", line.text));
    state.speed_mm_s = *feed / 60;
  }
  return MoveTo(machine, state.last_mm, state.speed_mm_s * state.speed_factor);
}

// Homes one axis after the other: to the end stop, back, and slowly again.
struct Homing {
  std::vector<std::size_t> axes;
  std::size_t next = 0;
  double until_s = 0;

  Result<bool> operator()(VirtualKlipper& machine) {
    if (machine.state() != KlippyState::kReady) {
      return Fail("Homing failed due to printer shutdown");
    }
    if (machine.print_now_s() < until_s) return false;
    if (next == axes.size()) return true;
    Start(machine, axes[next++]);
    return false;
  }

  void Start(VirtualKlipper& machine, std::size_t axis) {
    constexpr double kRetractMm = 5;
    MotionQueue& motion = machine.motion();
    // From here on Klipper's coordinate of this axis is the true one.
    std::array<double, 4> place = machine.commanded_mm;
    place[axis] += machine.physical_offset_mm[axis];
    machine.physical_offset_mm[axis] = 0;
    motion.SetPosition({place[0], place[1], place[2]}, machine.print_now_s());
    machine.commanded_mm = place;
    machine.homed[axis] = true;
    const double speed = machine.config().homing_speed_mm_s[axis];
    const std::array<std::pair<double, double>, 3> legs = {
        {{0, speed}, {kRetractMm, speed}, {0, speed / 2}}};
    for (const auto& [goal_mm, speed_mm_s] : legs) {
      std::array<double, 4> to = machine.commanded_mm;
      to[axis] = goal_mm;
      const double path_mm = std::abs(goal_mm - machine.commanded_mm[axis]);
      const Move move = Limited(machine, machine.commanded_mm, to, speed_mm_s, path_mm);
      machine.commanded_mm = to;
      if (HasMotion(move)) motion.Append(move, machine.print_now_s());
    }
    motion.Flush(machine.print_now_s());
    until_s = motion.print_time_s();
    machine.gcode.last_mm = machine.commanded_mm;
    machine.gcode.base_mm[axis] = machine.gcode.homing_mm[axis];
    machine.Record(
        "homed", static_cast<double>(std::count(machine.homed.begin(), machine.homed.end(), true)));
  }
};

Result<Outcome> Home(VirtualKlipper& machine, const Command& line) {
  Homing homing;
  for (std::size_t axis = 0; axis < 3; ++axis) {
    if (line.has(kAxes[axis])) homing.axes.push_back(axis);
  }
  if (homing.axes.empty()) homing.axes = {0, 1, 2};
  machine.motion().Flush(machine.print_now_s());
  homing.until_s = machine.motion().print_time_s();
  return Outcome{homing, {}};
}

Result<Outcome> Wait_(VirtualKlipper& machine, const Command&) { return WaitForMoves(machine); }

Result<Outcome> Dwell(VirtualKlipper& machine, const Command& line) {
  const auto delay = TRY(FloatOf(line, "P", {0, {}, {}}));
  machine.motion().Dwell(delay.value_or(0) / 1000, machine.print_now_s());
  return WaitForRoom();
}

Result<Outcome> MotorsOff(VirtualKlipper& machine, const Command&) {
  Outcome outcome = WaitForMoves(machine);
  const Wait wait = outcome.wait;
  outcome.wait = [wait](VirtualKlipper& m) -> Result<bool> {
    const Result<bool> done = wait(m);
    if (!done || !*done) return done;
    m.homed = {};
    m.Record("homed", 0);
    return true;
  };
  return outcome;
}

}  // namespace

const std::map<std::string, Handler>& MotionCommands() {
  static const std::map<std::string, Handler> commands = {
      {"G0", Move_}, {"G1", Move_},      {"G28", Home},      {"M400", Wait_},
      {"G4", Dwell}, {"M84", MotorsOff}, {"M18", MotorsOff},
  };
  return commands;
}

}  // namespace trammel::sim
