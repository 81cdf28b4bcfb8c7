// G-code for pins, messages, files, timers and the host itself.
#include <fmt/format.h>

#include <algorithm>
#include <cctype>
#include <nlohmann/json.hpp>

#include "base/text.h"
#include "sim/klipper/commands.h"

namespace trammel::sim {

namespace {

Result<Outcome> SetPinCommand(VirtualKlipper& machine, const Command& line) {
  const auto name = TRY(RequiredText(line, "PIN"));
  if (machine.pins.count(name) == 0) {
    return Fail(fmt::format("The value '{}' is not valid for PIN", name));
  }
  const auto value = TRY(RequiredFloat(line, "VALUE", {0, {}, 1}));
  // In step with the motion: the pin changes when the last queued move ends.
  machine.motion().AfterLastMove(
      [&machine, pin = name, to = value](double print_time_s) {
        machine.At(print_time_s, [&machine, pin, to] { machine.SetPin(pin, to); });
      },
      machine.print_now_s());
  return Outcome{};
}

Result<Outcome> Echo(VirtualKlipper& machine, const Command& line) {
  if (line.name == "M118") {
    machine.Respond("echo: " + line.rest);
    return Outcome{};
  }
  std::string prefix = "echo:";
  const std::string type = line.text_of("TYPE");
  if (type == "command") prefix = "//";
  if (type == "error") prefix = "!!";
  if (line.has("TYPE") && type != "command" && type != "error" && type != "echo") {
    return Fail(
        fmt::format("RESPOND TYPE '{}' is invalid. Must be one of 'echo', 'command', or "
                    "'error'",
                    type));
  }
  machine.Respond(line.text_of("PREFIX", prefix) + " " + line.text_of("MSG"));
  return Outcome{};
}

Result<Outcome> RestartCommand(VirtualKlipper& machine, const Command&) {
  machine.Restart();
  return Outcome{};
}

// Only tools have anything to save. Included files are unchanged.
Result<Outcome> SaveConfig(VirtualKlipper& machine, const Command&) {
  if (!machine.save_config_pending) return Outcome{};
  for (const ToolConfig& tool : machine.tool_configs()) {
    const auto items = machine.pending_items.find(tool.name);
    if (items == machine.pending_items.end() || !machine.faults().included_tools) continue;
    return Fail(fmt::format("SAVE_CONFIG section '{}' option '{}' conflicts with included value",
                            tool.name, items->second.begin()->first));
  }
  for (ToolConfig& tool : machine.tool_configs()) {
    const auto items = machine.pending_items.find(tool.name);
    if (items == machine.pending_items.end()) continue;
    for (std::size_t axis = 0; axis < kToolOffsetNames.size(); ++axis) {
      const auto item = items->second.find(kToolOffsetNames[axis]);
      if (item != items->second.end()) {
        tool.offset_mm[axis] = ToNumber(item->second).value_or(tool.offset_mm[axis]);
      }
    }
  }
  machine.Restart();
  return Outcome{};
}

Result<Outcome> Stop(VirtualKlipper& machine, const Command&) {
  machine.Shutdown("Shutdown due to M112 command");
  return Outcome{};
}

Result<Outcome> DelayGcode(VirtualKlipper& machine, const Command& line) {
  const auto id = TRY(RequiredText(line, "ID"));
  const std::string name = UpperCase(id);
  if (machine.config().delayed_gcode.count(name) == 0) {
    return Fail(fmt::format("The value '{}' is not valid for ID", id));
  }
  const auto duration = TRY(RequiredFloat(line, "DURATION", {0, {}, {}}));
  machine.delayed_at_s.erase(name);
  if (duration > 0) machine.delayed_at_s[name] = machine.now_s() + duration;
  return Outcome{};
}

Result<Outcome> PrintFile(VirtualKlipper& machine, const Command& line) {
  if (machine.print.running) return Fail("SD busy");
  const auto name = TRY(RequiredText(line, "FILENAME"));
  const std::string file = !name.empty() && name.front() == '/' ? name.substr(1) : name;
  const auto found = machine.files().find(file);
  if (found == machine.files().end()) return Fail("Unable to open file");
  machine.print = {};
  machine.print.filename = file;
  machine.print.lines = SplitLines(found->second);
  machine.print.size_bytes = found->second.size();
  machine.print.loaded = machine.print.running = true;
  machine.print.state = "printing";
  machine.print.started_s = machine.now_s();
  machine.plate_cleaned_s = machine.now_s();
  machine.print.e_start_mm = machine.commanded_mm[3];
  machine.Respond(fmt::format("File opened:{} Size:{}", file, found->second.size()));
  machine.Respond("File selected");
  return Outcome{};
}

Result<Outcome> ResetFile(VirtualKlipper& machine, const Command&) {
  // From the console this ends a print; the file itself could not continue.
  machine.print = {};
  return Outcome{};
}

Result<Outcome> Pause(VirtualKlipper& machine, const Command&) {
  if (machine.print.paused) {
    machine.Inform("Print already paused");
    return Outcome{};
  }
  if (machine.print.running) {
    machine.print.state = "paused";
  } else {
    machine.Inform("action:paused");
  }
  machine.print.running = false;
  machine.print.paused = true;
  machine.saved["PAUSE_STATE"] = machine.gcode;
  return Outcome{};
}

Result<Outcome> Resume(VirtualKlipper& machine, const Command&) {
  if (!machine.print.paused) {
    machine.Inform("Print is not paused, resume aborted");
    return Outcome{};
  }
  machine.print.paused = false;
  if (machine.print.loaded) {
    machine.print.running = true;
    machine.print.state = "printing";
  } else {
    machine.Inform("action:resumed");
  }
  return Outcome{{}, {"RESTORE_GCODE_STATE NAME=PAUSE_STATE MOVE=1 MOVE_SPEED=50"}};
}

Result<Outcome> Cancel(VirtualKlipper& machine, const Command&) {
  if (!machine.print.loaded) machine.Inform("action:cancel");
  if (machine.print.loaded) machine.print.state = "cancelled";
  machine.print.loaded = machine.print.running = machine.print.paused = false;
  machine.print.size_bytes = machine.print.read_bytes = 0;
  machine.print.ended_s = machine.now_s();
  return Outcome{};
}

Result<Outcome> StartSd(VirtualKlipper& machine, const Command&) {
  if (machine.print.running) return Fail("SD busy");
  if (machine.print.loaded) {
    machine.print.running = true;
    machine.print.paused = false;
    machine.print.state = "printing";
  }
  return Outcome{};
}

Result<Outcome> ForgetPause(VirtualKlipper& machine, const Command&) {
  machine.print.paused = false;
  return Outcome{};
}

Result<Outcome> Nothing(VirtualKlipper&, const Command&) { return Outcome{}; }

Result<void> CheckGuard(const VirtualKlipper& machine, const MacroGuard& guard) {
  const auto text = [&](const std::string& name) -> std::string {
    const auto macro = machine.kept.find(guard.macro);
    if (macro == machine.kept.end()) return "none";
    const auto found = macro->second.find(name);
    return found == macro->second.end() ? "none" : found->second;
  };
  if (text(guard.kept) == guard.value) return {};
  return Fail(fmt::format("trammel: no contact, {}: {}", text(guard.kept), text(guard.because)));
}

// Returns the value of "{NAME|default|factor}", here without the braces.
std::string Placed(const VirtualKlipper& machine, const Command& line, const std::string& place) {
  if (place == "rawparams") return line.rest;
  if (place == "print_time") return fmt::format("{:.6f}", machine.motion().print_time_s());
  const std::size_t bar = place.find('|');
  const std::size_t second = std::min(place.find('|', bar + 1), place.size());
  const std::string text =
      line.text_of(place.substr(0, bar), place.substr(bar + 1, second - bar - 1));
  if (second == place.size()) return text;
  return fmt::format("{:.6f}",
                     ToNumber(text).value_or(0) * ToNumber(place.substr(second + 1)).value_or(1));
}

std::vector<std::string> LinesWith(const VirtualKlipper& machine, const MacroConfig& macro,
                                   const Command& line) {
  std::vector<std::string> lines;
  for (const std::string& text : macro.lines) {
    std::string& filled = lines.emplace_back();
    for (std::size_t at = 0; at < text.size();) {
      const std::size_t open = std::min(text.find('{', at), text.size());
      filled += text.substr(at, open - at);
      if (open == text.size()) break;
      const std::size_t close = std::min(text.find('}', open), text.size());
      filled += Placed(machine, line, text.substr(open + 1, close - open - 1));
      at = close + 1;
    }
  }
  return lines;
}

// @returns whether the macro's lines are to be run.
Result<bool> MindOwner(VirtualKlipper& machine, OwnerRule rule, const Command& line) {
  if (rule == OwnerRule::kNone) return true;
  std::string& owner = machine.kept["_TRAMMEL_RUN"]["owner"];
  const std::string given = line.text_of("OWNER");
  const bool others = !given.empty() && given != owner;
  if (rule == OwnerRule::kGive) {
    if (!others) owner.clear();
    return !others;
  }
  if (others && !owner.empty()) {
    return Fail(
        fmt::format("trammel: {} has this printer. Where it is dead: TRAMMEL_RELEASE", owner));
  }
  if (others) owner = given;
  return true;
}

// Runs a macro's lines, after its call of a client.
Result<Outcome> RunMacro(VirtualKlipper& machine, const MacroConfig& macro, const Command& line) {
  if (macro.guard) {
    TRY(CheckGuard(machine, *macro.guard));
  }
  const auto minded = TRY(MindOwner(machine, macro.owner, line));
  if (!minded) return Outcome{};
  machine.MindSettings(macro.settings);
  if (!macro.keeps.empty()) {
    auto& kept = machine.kept[line.name];
    kept.clear();
    for (const std::string& name : macro.keeps) {
      if (line.has(name)) kept[name] = line.parameters.at(name);
    }
  }
  if (!macro.remote_method.empty()) {
    KlipperEvent event;
    event.kind = KlipperEvent::Kind::kRemoteCall;
    event.text = macro.remote_method;
    for (const RemoteArgument& argument : macro.remote_arguments) {
      const std::string text = line.text_of(argument.parameter, argument.fallback);
      KlipperEvent::Argument given{argument.key, text, std::nullopt};
      if (argument.number) given.number = ToNumber(text).value_or(0);
      event.arguments.push_back(given);
    }
    machine.CallRemote(std::move(event));
  }
  return Outcome{{}, LinesWith(machine, macro, line)};
}

}  // namespace

const std::map<std::string, Handler>& HostCommands() {
  static const std::map<std::string, Handler> commands = {
      {"SET_PIN", SetPinCommand},
      {"M117", Nothing},
      {"M118", Echo},
      {"RESPOND", Echo},
      {"RESTART", RestartCommand},
      {"FIRMWARE_RESTART", RestartCommand},
      {"SAVE_CONFIG", SaveConfig},
      {"M112", Stop},
      {"UPDATE_DELAYED_GCODE", DelayGcode},
      {"SDCARD_PRINT_FILE", PrintFile},
      {"SDCARD_RESET_FILE", ResetFile},
      {"M24", StartSd},
      {"M25", Pause},
      {"M73", Nothing},
  };
  return commands;
}

namespace {

const std::map<std::string, Handler>& PauseCommands() {
  static const std::map<std::string, Handler> commands = {
      {"PAUSE", Pause}, {"RESUME", Resume}, {"CLEAR_PAUSE", ForgetPause}, {"CANCEL_PRINT", Cancel}};
  return commands;
}

}  // namespace

std::vector<const std::map<std::string, Handler>*> CommandTables(const VirtualKlipper& machine) {
  std::vector<const std::map<std::string, Handler>*> tables = {
      &MotionCommands(), &SettingCommands(), &VariableCommands(), &HeatCommands(), &HostCommands()};
  if (machine.config().pause_resume) tables.push_back(&PauseCommands());
  if (machine.cell() != nullptr) tables.push_back(&ProbeCommands());
  if (!machine.tools.empty()) tables.push_back(&ToolCommands());
  return tables;
}

Result<Outcome> RunCommand(VirtualKlipper& machine, const Command& line) {
  static constexpr std::array<const char*, 3> kAlways = {"M112", "RESTART", "FIRMWARE_RESTART"};
  const bool always = std::find(kAlways.begin(), kAlways.end(), line.name) != kAlways.end();
  if (machine.state() != KlippyState::kReady && !always) return Fail(machine.state_message());
  const auto macro = machine.config().macros.find(line.name);
  if (macro != machine.config().macros.end()) {
    if (!line.fault.empty()) return Fail(line.fault);
    return RunMacro(machine, macro->second, line);
  }
  for (const auto* table : CommandTables(machine)) {
    const auto found = table->find(line.name);
    if (found == table->end()) continue;
    if (!line.fault.empty()) return Fail(line.fault);
    return found->second(machine, line);
  }
  if (IsToolChange(machine, line.name)) return ChangeTool(machine, line);
  machine.Inform(fmt::format("Unknown command:\"{}\"", line.name));
  return Outcome{};
}

namespace {

// Accepts only texts: a Python literal in quotes.
Result<Outcome> SetVariable(VirtualKlipper& machine, const Command& line) {
  const auto macro = TRY(RequiredText(line, "MACRO"));
  const auto name = TRY(RequiredText(line, "VARIABLE"));
  const auto value = TRY(RequiredText(line, "VALUE"));
  const auto found = machine.config().macros.find(UpperCase(macro));
  if (found == machine.config().macros.end()) {
    return Fail(fmt::format("The value '{}' is not valid for MACRO", macro));
  }
  if (found->second.variables.count(name) == 0) {
    return Fail(fmt::format("Unknown gcode_macro variable '{}'", name));
  }
  if (value.size() < 2 || value.front() != '\'' || value.back() != '\'') {
    return Fail(fmt::format("Unable to parse '{}' as a literal", value));
  }
  machine.kept[found->first][name] = value.substr(1, value.size() - 2);
  return Outcome{};
}

// Klipper handles neither an invalid literal nor the configuration reader's error about a `%`: both
// shut it down.
Result<Outcome> SaveVariable(VirtualKlipper& machine, const Command& line) {
  const auto name = TRY(RequiredText(line, "VARIABLE"));
  const auto value = TRY(RequiredText(line, "VALUE"));
  const bool capital =
      std::any_of(name.begin(), name.end(), [](unsigned char c) { return std::isupper(c) != 0; });
  if (capital) return Fail("VARIABLE must not contain upper case");
  // Accepts only those Python literals that differ from JSON in their quotes alone.
  std::string literal = value;
  std::replace(literal.begin(), literal.end(), '\'', '"');
  const auto parsed = nlohmann::json::parse(literal, nullptr, false);
  if (parsed.is_discarded() || value.find('%') != std::string::npos) {
    machine.Shutdown("Internal error on command:\"SAVE_VARIABLE\"");
    return Outcome{};
  }
  machine.saved_variables[name] = literal;
  return Outcome{};
}

}  // namespace

const std::map<std::string, Handler>& VariableCommands() {
  static const std::map<std::string, Handler> commands = {{"SET_GCODE_VARIABLE", SetVariable},
                                                          {"SAVE_VARIABLE", SaveVariable}};
  return commands;
}

}  // namespace trammel::sim
