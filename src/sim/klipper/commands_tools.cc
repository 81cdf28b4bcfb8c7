// G-code of klipper-toolchanger that changes what a tool keeps (its tool.py and toolchanger.py).
#include <fmt/format.h>

#include <algorithm>

#include "sim/klipper/commands.h"

namespace trammel::sim {
namespace {

/// Python raises where Klipper's author did not expect it: Klipper stops.
tl::unexpected<Error> InternalError(VirtualKlipper& machine, const CommandLine& line) {
  const std::string what = fmt::format("Internal error on command:\"{}\"", line.name);
  machine.Shutdown(what);
  return tl::unexpected(Error{ErrorKind::kInput, what});
}

const ToolConfig* ConfigOf(const VirtualKlipper& machine, int number) {
  for (const ToolConfig& tool : machine.config().tools) {
    if (tool.number == number) return &tool;
  }
  return nullptr;
}

/// The tool that T or TOOL names; no tool is ever selected here. The words are the real ones,
/// whatever the command.
Result<int> ToolOf(const VirtualKlipper& machine, const CommandLine& line) {
  if (const auto name = line.parameters.find("TOOL"); name != line.parameters.end()) {
    for (const ToolConfig& tool : machine.config().tools) {
      if (tool.name == name->second) return tool.number;
    }
    return Fail(fmt::format("Unknown config object '{}'", name->second));
  }
  const auto number = TRY(FloatOf(line, "T"));
  if (!number) return Fail("SET_TOOL_TEMPERATURE: No tool specified and no active tool");
  constexpr double kMost = 1e6;
  const int tool = static_cast<int>(std::clamp(*number, -kMost, kMost));
  if (tool != *number) {
    return Fail(
        fmt::format("Error on '{}': unable to parse {}", line.text, line.parameters.at("T")));
  }
  if (ConfigOf(machine, tool) == nullptr) {
    return Fail(fmt::format("SET_TOOL_TEMPERATURE: T{} not found", tool));
  }
  return tool;
}

/// Numbers, texts in quotes, True, False and None; other literals are not known here.
bool IsLiteral(const std::string& text) {
  if (ToNumber(text) || text == "True" || text == "False" || text == "None") return true;
  const char quote = text.empty() ? ' ' : text.front();
  return text.size() >= 2 && (quote == '\'' || quote == '"') && text.back() == quote;
}

bool IsOffset(const std::string& name) {
  for (const char* offset : kToolOffsetNames) {
    if (name == offset) return true;
  }
  return false;
}

void ApplyParameter(VirtualKlipper& machine, int tool, const std::string& name,
                    const std::string& value) {
  for (std::size_t axis = 0; axis < kToolOffsetNames.size(); ++axis) {
    if (name != kToolOffsetNames[axis]) continue;
    machine.tools[tool].offset_mm[axis] = ToNumber(value).value_or(0);
    machine.Record(fmt::format("tool{}_{}", tool, name), machine.tools[tool].offset_mm[axis]);
  }
}

Result<Outcome> SetParameter(VirtualKlipper& machine, const CommandLine& line) {
  const auto tool = TRY(ToolOf(machine, line));
  const auto name = TRY(RequiredText(line, "PARAMETER"));
  const auto value = TRY(RequiredText(line, "VALUE"));
  if (!IsLiteral(value) || (IsOffset(name) && !ToNumber(value))) {
    return InternalError(machine, line);
  }
  if (machine.faults().deaf_tools) return Outcome{};
  ToolState& state = machine.tools[tool];
  const auto known = state.parameters.find(name);
  // What an offset was before it was set for the first time is not kept; a quirk of the real one.
  if (known != state.parameters.end()) state.originals.emplace(name, known->second);
  state.parameters[name] = value;
  ApplyParameter(machine, tool, name, value);
  return Outcome{};
}

Result<Outcome> ResetParameter(VirtualKlipper& machine, const CommandLine& line) {
  const auto tool = TRY(ToolOf(machine, line));
  const auto name = TRY(RequiredText(line, "PARAMETER"));
  ToolState& state = machine.tools[tool];
  const auto original = state.originals.find(name);
  if (original == state.originals.end()) return Outcome{};
  state.parameters[name] = original->second;
  ApplyParameter(machine, tool, name, original->second);
  return Outcome{};
}

Result<Outcome> SaveParameter(VirtualKlipper& machine, const CommandLine& line) {
  const auto tool = TRY(ToolOf(machine, line));
  const auto name = TRY(RequiredText(line, "PARAMETER"));
  const ToolState& state = machine.tools[tool];
  const auto value = state.parameters.find(name);
  if (value == state.parameters.end()) {
    return Fail(fmt::format("Tool does not have parameter {}", name));
  }
  machine.pending_items[ConfigOf(machine, tool)->name][name] = value->second;
  machine.save_config_pending = true;
  return Outcome{};
}

/// As before December 2025: the tool's offset becomes G-code's own, where it was changed before the
/// tool is selected.
Result<Outcome> Select(VirtualKlipper& machine, int number) {
  const ToolConfig* tool = ConfigOf(machine, number);
  if (tool == nullptr) return Fail(fmt::format("Select tool: T{} not found", number));
  for (std::size_t axis = 0; axis < 3; ++axis) {
    if (!machine.homed[axis]) {
      return Fail("Cannot perform toolchange, axis not homed. Required: xyz");
    }
  }
  if (machine.active_tool == number) {
    machine.Inform(fmt::format("Tool {} already selected", tool->name));
    return Outcome{};
  }
  machine.active_tool = number;
  machine.active_extruder = tool->extruder();
  machine.Inform(fmt::format("Selected tool {} ({})", number, tool->name));
  const std::array<double, 3>& offset_mm = machine.tools[number].offset_mm;
  return Outcome{
      {},
      {fmt::format("SET_GCODE_OFFSET X={} Y={} Z={}", offset_mm[0], offset_mm[1], offset_mm[2])}};
}

Result<Outcome> SelectTool(VirtualKlipper& machine, const CommandLine& line) {
  const auto tool = TRY(ToolOf(machine, line));
  return Select(machine, tool);
}

}  // namespace

bool IsToolChange(const VirtualKlipper& machine, const std::string& name) {
  const auto& tools = machine.config().tools;
  return std::any_of(tools.begin(), tools.end(), [&](const ToolConfig& tool) {
    return name == fmt::format("T{}", tool.number);
  });
}

Result<Outcome> ChangeTool(VirtualKlipper& machine, const CommandLine& line) {
  return Select(machine, static_cast<int>(ToNumber(line.name.substr(1)).value_or(-1)));
}

const std::map<std::string, Handler>& ToolCommands() {
  static const std::map<std::string, Handler> commands = {
      {"SET_TOOL_PARAMETER", SetParameter},
      {"RESET_TOOL_PARAMETER", ResetParameter},
      {"SAVE_TOOL_PARAMETER", SaveParameter},
      {"SELECT_TOOL", SelectTool},
  };
  return commands;
}

}  // namespace trammel::sim
