#include <fmt/format.h>

#include <algorithm>
#include <cctype>

#include "sim/sheet/sheet_interpreter.h"

namespace trammel::sim {
namespace sheet {
namespace {

constexpr Bound kPercent{1, 1e4};
constexpr int kMaxCommands = 5'000'000;
constexpr std::size_t kMaxNames = 200;
constexpr int kDeepestMacro = 10;
// Commands of the three firmwares that never move a tool to another position.
constexpr std::string_view kSilent =
    " G4 G10 G11 G17 G21 G29 G94 M0 M1 M17 M18 M24 M25 M73 M84 M104 M105 M106 M107 M109 M110 M114 "
    "M115 M116 M117 M118 M140 M155 M190 M201 M203 M204 M205 M211 M220 M226 M400 M420 M500 M501 "
    "M566 "
    "M568 M572 M593 M601 M900 CLEAR_PAUSE RESUME RESPOND SAVE_CONFIG SAVE_TOOL_PARAMETER "
    "SET_HEATER_TEMPERATURE SET_PRESSURE_ADVANCE SET_VELOCITY_LIMIT TEMPERATURE_WAIT "
    "_TRAMMEL_KEEP_SETTINGS _TRAMMEL_BRING_BACK_SETTINGS ";

}  // namespace

const std::map<std::string, Interpreter::Handler, std::less<>>& Interpreter::Handlers() {
  using I = Interpreter;
  static const std::map<std::string, Handler, std::less<>> handlers = {
      {"G0", &I::Linear},
      {"G1", &I::Linear},
      {"G2", &I::Arc},
      {"G3", &I::Arc},
      {"G5", &I::Refuse},
      {"G20", &I::Refuse},
      {"G28", &I::HomeAxes},
      {"G90", &I::SetModes},
      {"G91", &I::SetModes},
      {"M82", &I::SetModes},
      {"M83", &I::SetModes},
      {"G92", &I::SetOrigin},
      {"M221", &I::SetExtrudeFactor},
      {"M200", &I::SetVolumetric},
      {"M120", &I::SaveState},
      {"M121", &I::RestoreState},
      {"SAVE_GCODE_STATE", &I::SaveState},
      {"PAUSE", &I::Pause},
      {"RESTORE_GCODE_STATE", &I::RestoreState},
      {"SET_GCODE_OFFSET", &I::SetGcodeOffset},
      {"SET_TOOL_PARAMETER", &I::SetToolParameter},
      {"SET_TOOL_OFFSET", &I::SetToolParameter},
      {"M218", &I::SetHotendOffset},
      {"G10", &I::SetToolOffset},
      {"ACTIVATE_EXTRUDER", &I::ActivateExtruder},
      {"SET_DUAL_CARRIAGE", &I::SetDualCarriage},
      {"SELECT_TOOL", &I::SelectTool},
  };
  return handlers;
}

void Interpreter::Ignore(const std::string& name) {
  if (kSilent.find(" " + name + " ") != std::string_view::npos) return;
  const std::string shown = name.substr(0, 40);
  const bool room = program_.ignored.size() < kMaxNames || program_.ignored.count(shown) > 0;
  ++program_.ignored[room ? shown : "others"];
}

Result<void> Interpreter::GoTo(const Axes& target, int line) {
  TRY(CheckMove(target, program_.moves.size(), line));
  const Axes& now = state_.machine;
  if (now == target) return {};
  const double e_mm = target[3] - now[3];
  if (e_mm > 0 && !tool_in_use_) {
    return Fail(
        fmt::format("G-code line {}: extrudes {} mm without a tool; select one", line, e_mm));
  }
  if (e_mm > 0 && has_carriages_ && extruder_ != tool_) {
    return Fail(
        fmt::format("G-code line {}: extruder {} extrudes while carriage {} moves; send "
                    "ACTIVATE_EXTRUDER with SET_DUAL_CARRIAGE",
                    line, extruder_, tool_));
  }
  SheetMove move;
  move.line = line;
  move.tool = tool_;
  move.pick_up = pick_up_;
  move.x_drive = has_carriages_ ? tool_ : 0;
  move.from = {now[0], now[1]};
  move.to = {target[0], target[1]};
  move.z_mm = std::max(now[2], target[2]);
  move.e_mm = e_mm;
  move.shift = {shift()[0], shift()[1]};
  program_.moves.push_back(move);
  state_.machine = target;
  return {};
}

Result<void> Interpreter::Linear(const Command& command) {
  if (setup_.firmware == SheetFirmware::kRepRapFirmware && command.has("R")) return Refuse(command);
  // On Klipper G91 makes the extruder relative too, despite M82.
  const bool absolute = state_.absolute_filament && (state_.absolute || !klipper());
  return GoTo(TRY(TargetOf(command, state_, shift(), absolute)), command.line);
}

Result<void> Interpreter::Refuse(const Command& command) {
  const bool inches = command.name == "G20";
  return Fail(fmt::format("G-code line {}: {} is not understood by the virtual machine; {}",
                          command.line, command.name,
                          inches ? "write millimetres" : "write straight G0 and G1 moves"));
}

Result<void> Interpreter::HomeAxes(const Command& command) {
  offsets_.Home();
  Home(command, state_);
  return {};
}

Result<void> Interpreter::SetOrigin(const Command& command) {
  return SetPosition(command, shift(), state_);
}

Result<void> Interpreter::SetModes(const Command& command) {
  const std::string& name = command.name;
  if (name == "M82" || name == "M83") {
    state_.absolute_filament = name == "M82";
    return {};
  }
  state_.absolute = name == "G90";
  if (setup_.firmware == SheetFirmware::kMarlin) state_.absolute_filament = name == "G90";
  return {};
}

Result<void> Interpreter::SetExtrudeFactor(const Command& command) {
  const auto number = TRY(NumberOf(command, "S", kPercent));
  if (number.has_value()) state_.extrude_factor = *number / 100;
  return {};
}

Result<void> Interpreter::SetVolumetric(const Command& command) {
  const auto diameter = TRY(NumberOf(command, "D", {0, 100}));
  return diameter.value_or(0) > 0 ? Refuse(command) : Result<void>{};
}

Result<void> Interpreter::SaveState(const Command& command) {
  if (setup_.firmware == SheetFirmware::kMarlin) return {};  // M120 is about endstops there
  const std::string name = command.text_of("NAME", "default");
  if (saved_.size() >= kMaxNames && saved_.count(name) == 0) {
    return Fail(fmt::format("G-code line {}: more than {} saved states", command.line, kMaxNames));
  }
  saved_[name] = {state_, offsets_.shift()};
  return {};
}

// [pause_resume] keeps the state; somebody tapes paper down, and RESUME brings it back.
Result<void> Interpreter::Pause(const Command& /*command*/) {
  if (!klipper()) return {};
  if (!setup_.pause_resume) {
    Ignore("PAUSE");
    return {};
  }
  saved_["PAUSE_STATE"] = {state_, offsets_.shift()};
  return {};
}

Result<void> Interpreter::RestoreState(const Command& command) {
  if (setup_.firmware == SheetFirmware::kMarlin) return {};
  const std::string name = command.text_of("NAME", "default");
  const auto kept = saved_.find(name);
  if (kept == saved_.end()) {
    return Fail(fmt::format("G-code line {}: {} without a saved state of its name", command.line,
                            command.name));
  }
  const State saved = kept->second;
  if (!klipper()) {
    state_.absolute = saved.absolute;
    state_.absolute_filament = saved.absolute_filament;
    return {};
  }
  Restore(saved, state_);
  offsets_.RestoreGcodeOffset(saved.shift);
  if (command.text_of("MOVE") != "1") return {};
  const Axes& then = saved.machine;
  return GoTo({then[0], then[1], then[2], state_.machine[3]}, command.line);
}

Result<void> Interpreter::RunMacro(const std::string& text, int number, int depth) {
  if (depth >= kDeepestMacro) {
    return Fail(
        fmt::format("G-code line {}: macros are nested deeper than {}; does one call "
                    "itself?",
                    number, kDeepestMacro));
  }
  std::string_view rest = text;
  while (!rest.empty()) {
    const std::size_t end = std::min(rest.size(), rest.find('\n'));
    TRY(Run(rest.substr(0, end), number, depth + 1));
    rest.remove_prefix(std::min(rest.size(), end + 1));
  }
  return {};
}

Result<void> Interpreter::Run(std::string_view line, int number, int depth) {
  const Command command = ParseCommand(line, number);
  if (command.name.empty()) return {};
  if (++commands_ > kMaxCommands) {
    return Fail(fmt::format("G-code line {}: more than {} commands, macros included", number,
                            kMaxCommands));
  }
  const auto macro = setup_.macros.find(command.name);
  if (macro != setup_.macros.end()) return RunMacro(macro->second, number, depth);
  const auto changed = TRY(RunToolCommand(command, line));
  if (changed) return {};
  const auto handler = Handlers().find(command.name);
  if (handler != Handlers().end()) return (this->*handler->second)(command);
  Ignore(command.name);
  return {};
}

}  // namespace sheet

namespace {

Result<void> RunAll(std::string_view gcode, sheet::Interpreter& interpreter) {
  int number = 0;
  while (!gcode.empty()) {
    const std::size_t end = std::min(gcode.size(), gcode.find('\n'));
    TRY(interpreter.Run(gcode.substr(0, end), ++number, 0));
    gcode.remove_prefix(std::min(gcode.size(), end + 1));
  }
  return {};
}

}  // namespace

Result<SheetProgram> InterpretSheet(std::string_view gcode, const SheetSetup& setup) {
  sheet::Interpreter interpreter(setup);
  if (const auto before = RunAll(setup.before, interpreter); !before) {
    return Fail("before the file: " + before.error().message);
  }
  TRY(RunAll(gcode, interpreter));
  return interpreter.Take();
}

}  // namespace trammel::sim
