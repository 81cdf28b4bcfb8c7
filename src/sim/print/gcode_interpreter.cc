#include "sim/print/gcode_interpreter.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <numbers>
#include <optional>
#include <utility>

#include "sim/gcode/command.h"
#include "sim/gcode/modes.h"

namespace trammel::sim {
namespace {

constexpr Bound kPositionMm{-1e4, 1e4};
constexpr Bound kFeedMmMin{1e-3, 6e6};
constexpr Bound kVelocityMmS{1e-3, 1e5};
constexpr Bound kAccelerationMmS2{1, 1e6};
constexpr Bound kCornerMmS{0, 1e3};
constexpr Bound kCornerMmMin{0, 6e4};
constexpr Bound kRatio{0, 0.999};
constexpr Bound kPressureAdvanceS{0, 10};
constexpr Bound kSmoothTimeS{0, 0.2};
constexpr Bound kPercent{1, 1e4};
constexpr Bound kDwellMs{0, 1e9};
constexpr Bound kTemperatureC{-300, 2000};
constexpr std::size_t kMaxIgnoredNames = 200;
constexpr std::size_t kMaxSavedStates = 100;

struct State : Modes {
  double feed_mm_s = 25;  // Klipper's, before any F
  double speed_factor = 1;
};

class Interpreter {
 public:
  explicit Interpreter(const InterpreterDefaults& defaults)
      : max_velocity_mm_s_(defaults.max_velocity_mm_s) {
    next_.acceleration_mm_s2 = defaults.acceleration_mm_s2;
    next_.corner_velocity_mm_s = defaults.corner_velocity_mm_s;
    next_.minimum_cruise_ratio = defaults.minimum_cruise_ratio;
    next_.smooth_time_s = defaults.smooth_time_s;
  }

  Result<void> Run(const Command& command);
  Program Take() { return std::move(program_); }

 private:
  // Reads a parameter into `target`, scaled; unchanged if the parameter is absent.
  Result<bool> Read(const Command& command, const std::string& key, const Bound& bound,
                    double& target, double factor = 1);
  Result<void> Linear(const Command& command);
  Result<void> GoTo(const Axes& target, int line);
  Result<void> Dwell(const Command& command);
  Result<void> HomeAxes(const Command& command);
  Result<void> SetMode(const Command& command);
  Result<void> Stop(const Command& command);
  Result<void> SetFactor(const Command& command);
  Result<void> SetOrigin(const Command& command);
  Result<void> SetOffset(const Command& command);
  Result<void> SetAcceleration(const Command& command);
  Result<void> SetVelocityLimit(const Command& command);
  Result<void> SetJerk(const Command& command);
  Result<void> SetPressureAdvance(const Command& command);
  Result<void> CheckModel(const Command& command);
  Result<void> SetTemperature(const Command& command);
  Result<void> SaveState(const Command& command);
  Result<void> RestoreState(const Command& command);
  using Handler = Result<void> (Interpreter::*)(const Command&);
  static const std::map<std::string, Handler>& Handlers();

  Program program_;
  State state_;
  std::map<std::string, State> saved_;
  Axes offset_{};  // SET_GCODE_OFFSET's part of the base
  Move next_;      // the template of the next move: limits and pressure advance in force
  double max_velocity_mm_s_;
  bool buddy_ = false;                  // Prusa's firmware prints
  double buddy_smooth_time_s_ = 0.040;  // its default
};

Result<bool> Interpreter::Read(const Command& command, const std::string& key, const Bound& bound,
                               double& target, double factor) {
  const auto number = TRY(NumberOf(command, key, bound));
  if (number) target = *number * factor;
  return number.has_value();
}

Result<void> Interpreter::GoTo(const Axes& target, int line) {
  TRY(CheckMove(target, program_.moves.size(), line));
  const Axes& now = state_.machine;
  if (now != target) {
    Move move = next_;
    move.from = {now[0], now[1], now[2]};
    move.to = {target[0], target[1], target[2]};
    move.e_mm = target[3] - now[3];
    move.feed_mm_s = std::min(max_velocity_mm_s_, state_.feed_mm_s * state_.speed_factor);
    program_.moves.push_back(move);
    next_.stop_before = false;
    next_.dwell_before_s = 0;
    state_.machine = target;
  }
  return {};
}

Result<void> Interpreter::Linear(const Command& command) {
  const Axes target =
      TRY(TargetOf(command, state_, {}, state_.absolute && state_.absolute_filament));
  TRY(Read(command, "F", kFeedMmMin, state_.feed_mm_s, 1.0 / 60));
  return GoTo(target, command.line);
}

Result<void> Interpreter::Dwell(const Command& command) {
  double seconds = 0;
  const auto milliseconds = TRY(Read(command, "P", kDwellMs, seconds, 1e-3));
  if (!milliseconds) {
    TRY(Read(command, "S", kDwellMs, seconds));
  }
  next_.stop_before = true;
  next_.dwell_before_s += seconds;
  return {};
}

Result<void> Interpreter::HomeAxes(const Command& command) {
  Home(command, state_);
  next_.stop_before = true;
  return {};
}

Result<void> Interpreter::SetMode(const Command& command) {
  const std::string& name = command.name;
  if (name == "G90" || name == "G91") {
    state_.absolute = name == "G90";
  } else {
    state_.absolute_filament = name == "M82";
  }
  return {};
}

Result<void> Interpreter::Stop(const Command& /*command*/) {
  next_.stop_before = true;
  return {};
}

Result<void> Interpreter::SetFactor(const Command& command) {
  double& factor = command.name == "M220" ? state_.speed_factor : state_.extrude_factor;
  TRY(Read(command, "S", kPercent, factor, 0.01));
  return {};
}

Result<void> Interpreter::SetOrigin(const Command& command) {
  return SetPosition(command, {}, state_);
}

// SET_GCODE_OFFSET shifts every later coordinate; its own MOVE=1 moves at once.
Result<void> Interpreter::SetOffset(const Command& command) {
  Axes target = state_.machine;
  for (std::size_t axis = 0; axis < 3; ++axis) {
    const auto set = TRY(NumberOf(command, kAxisKeys[axis], kPositionMm));
    const auto adjust =
        TRY(NumberOf(command, std::string(kAxisKeys[axis]) + "_ADJUST", kPositionMm));
    // An absolute offset replaces this command's earlier one; G92 shifts are rare in combination.
    const double shift = set.has_value() ? *set - offset_[axis] : adjust.value_or(0);
    offset_[axis] += shift;
    state_.base[axis] += shift;
    target[axis] += shift;
  }
  return command.text_of("MOVE") == "1" ? GoTo(target, command.line) : Result<void>{};
}

Result<void> Interpreter::SetAcceleration(const Command& command) {
  double print = 0;
  double travel = 0;
  const auto both = TRY(Read(command, "S", kAccelerationMmS2, next_.acceleration_mm_s2));
  const auto p = TRY(Read(command, "P", kAccelerationMmS2, print));
  const auto t = TRY(Read(command, "T", kAccelerationMmS2, travel));
  if (!both && p) {
    next_.acceleration_mm_s2 = t ? std::min(print, travel) : print;
  }
  return {};
}

Result<void> Interpreter::SetVelocityLimit(const Command& command) {
  TRY(Read(command, "VELOCITY", kVelocityMmS, max_velocity_mm_s_));
  TRY(Read(command, "ACCEL", kAccelerationMmS2, next_.acceleration_mm_s2));
  TRY(Read(command, "SQUARE_CORNER_VELOCITY", kCornerMmS, next_.corner_velocity_mm_s));
  double accel_to_decel = 0;
  if (TRY(Read(command, "ACCEL_TO_DECEL", kAccelerationMmS2, accel_to_decel))) {
    next_.minimum_cruise_ratio =
        std::clamp(1 - accel_to_decel / next_.acceleration_mm_s2, kRatio.lo, kRatio.hi);
  }
  TRY(Read(command, "MINIMUM_CRUISE_RATIO", kRatio, next_.minimum_cruise_ratio));
  return {};
}

// Marlin's classic jerk bounds each axis' sudden change of speed; where an axis reverses, the
// larger of its two speeds. Arms at +-45 degrees to the axes turn at sqrt 2 times the jerk by that
// rule, and so do here all right angles. RepRapFirmware's M566 is the same in mm/min.
Result<void> Interpreter::SetJerk(const Command& command) {
  const bool per_minute = command.name == "M566";
  TRY(Read(command, "X", per_minute ? kCornerMmMin : kCornerMmS, next_.corner_velocity_mm_s,
           std::numbers::sqrt2 / (per_minute ? 60 : 1)));
  return {};
}

// Klipper's SET_PRESSURE_ADVANCE ADVANCE averages over its smooth time. M900 K of Marlin and M572 S
// of RepRapFirmware do not; Bambu's M900 is not published, and does not here. M572 of Prusa's Buddy
// averages over W, which remains in force; RepRapFirmware's has no W.
Result<void> Interpreter::SetPressureAdvance(const Command& command) {
  const char* key = command.name == "M900" ? "K" : command.name == "M572" ? "S" : "ADVANCE";
  TRY(Read(command, key, kPressureAdvanceS, next_.pressure_advance_s));
  if (command.name == "SET_PRESSURE_ADVANCE") {
    TRY(Read(command, "SMOOTH_TIME", kSmoothTimeS, next_.smooth_time_s));
  } else if (command.name == "M572") {
    if (TRY(Read(command, "W", kSmoothTimeS, buddy_smooth_time_s_))) buddy_ = true;
    next_.smooth_time_s = buddy_ ? buddy_smooth_time_s_ : 0;
  } else {
    next_.smooth_time_s = 0;
  }
  next_.stop_before = true;
  return {};
}

// Only Prusa's firmware checks its printer's model.
Result<void> Interpreter::CheckModel(const Command& /*command*/) {
  buddy_ = true;
  return {};
}

Result<void> Interpreter::SetTemperature(const Command& command) {
  const bool heater = command.name == "SET_HEATER_TEMPERATURE";
  double target_c = 0;
  TRY(Read(command, heater ? "TARGET" : "S", kTemperatureC, target_c));
  if (heater || command.name == "M104" || command.name == "M109") {
    program_.hottest_nozzle_c = std::max(program_.hottest_nozzle_c, target_c);
  }
  return {};
}

Result<void> Interpreter::SaveState(const Command& command) {
  const std::string name = command.text_of("NAME", "default");
  if (saved_.size() >= kMaxSavedStates && saved_.count(name) == 0) {
    return Fail(
        fmt::format("G-code line {}: more than {} saved states", command.line, kMaxSavedStates));
  }
  saved_[name] = state_;
  return {};
}

Result<void> Interpreter::RestoreState(const Command& command) {
  const std::string name = command.text_of("NAME", "default");
  const auto kept = saved_.find(name);
  if (kept == saved_.end()) {
    return Fail(fmt::format("G-code line {}: RESTORE_GCODE_STATE without a saved state of its name",
                            command.line));
  }
  const State saved = kept->second;
  Restore(saved, state_);
  state_.feed_mm_s = saved.feed_mm_s;
  state_.speed_factor = saved.speed_factor;
  if (command.text_of("MOVE") != "1") return {};
  const double feed = state_.feed_mm_s;
  TRY(Read(command, "MOVE_SPEED", kVelocityMmS, state_.feed_mm_s));
  auto went =
      GoTo({saved.machine[0], saved.machine[1], saved.machine[2], state_.machine[3]}, command.line);
  state_.feed_mm_s = feed;
  return went;
}

const std::map<std::string, Interpreter::Handler>& Interpreter::Handlers() {
  using I = Interpreter;
  static const std::map<std::string, Handler> handlers = {
      {"G0", &I::Linear},
      {"G1", &I::Linear},
      {"G4", &I::Dwell},
      {"G28", &I::HomeAxes},
      {"G90", &I::SetMode},
      {"G91", &I::SetMode},
      {"M82", &I::SetMode},
      {"M83", &I::SetMode},
      {"G92", &I::SetOrigin},
      {"M400", &I::Stop},
      {"SAVE_GCODE_STATE", &I::SaveState},
      {"M120", &I::SaveState},
      {"RESTORE_GCODE_STATE", &I::RestoreState},
      {"M121", &I::RestoreState},
      {"SET_GCODE_OFFSET", &I::SetOffset},
      {"SET_VELOCITY_LIMIT", &I::SetVelocityLimit},
      {"M204", &I::SetAcceleration},
      {"M205", &I::SetJerk},
      {"M566", &I::SetJerk},
      {"SET_PRESSURE_ADVANCE", &I::SetPressureAdvance},
      {"M900", &I::SetPressureAdvance},
      {"M572", &I::SetPressureAdvance},
      {"M862.3", &I::CheckModel},
      {"M220", &I::SetFactor},
      {"M221", &I::SetFactor},
      {"M104", &I::SetTemperature},
      {"M109", &I::SetTemperature},
      {"M140", &I::SetTemperature},
      {"M190", &I::SetTemperature},
      {"SET_HEATER_TEMPERATURE", &I::SetTemperature}};
  return handlers;
}

Result<void> Interpreter::Run(const Command& command) {
  static constexpr const char* kSilent[] = {"M106",
                                            "M107",
                                            "M84",
                                            "M18",
                                            "M117",
                                            "M118",
                                            "G21",
                                            "M17",
                                            "M555",
                                            "G29",
                                            "G29.2",
                                            "M975",
                                            "_TRAMMEL_KEEP_SETTINGS",
                                            "_TRAMMEL_BRING_BACK_SETTINGS"};
  if (const auto handler = Handlers().find(command.name); handler != Handlers().end()) {
    return (this->*handler->second)(command);
  }
  const bool silent =
      std::find(std::begin(kSilent), std::end(kSilent), command.name) != std::end(kSilent);
  if (command.name.empty() || silent) return {};
  const std::string name = command.name.substr(0, 40);
  const bool room = program_.ignored.size() < kMaxIgnoredNames || program_.ignored.count(name) > 0;
  ++program_.ignored[room ? name : "others"];
  return {};
}

}  // namespace

Result<Program> InterpretGcode(std::string_view text, const InterpreterDefaults& defaults) {
  Interpreter interpreter(defaults);
  int line_number = 0;
  while (!text.empty()) {
    const std::size_t end = std::min(text.size(), text.find('\n'));
    TRY(interpreter.Run(ParseCommand(text.substr(0, end), ++line_number)));
    text.remove_prefix(std::min(text.size(), end + 1));
  }
  return interpreter.Take();
}

}  // namespace trammel::sim
