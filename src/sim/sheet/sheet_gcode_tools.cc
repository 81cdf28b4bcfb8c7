// Tool changes and tool offsets.
#include <fmt/format.h>

#include <algorithm>
#include <cctype>
#include <cmath>
#include <numbers>

#include "base/text.h"
#include "sim/sheet/sheet_interpreter.h"

namespace trammel::sim::sheet {

namespace {

constexpr Bound kOffsetMm{-1e3, 1e3};

// "T1" and "tool T1".
Result<int> ToolNamed(const std::string& name, int line) {
  const std::string upper = UpperCase(name);
  const std::size_t size = upper.size();
  if (size >= 2 && upper[size - 2] == 'T' && upper[size - 1] >= '0' &&
      upper[size - 1] < '0' + kMaxSheetTools) {
    return upper[size - 1] - '0';
  }
  return Fail(fmt::format("G-code line {}: there is no tool '{}'; give T=0 … {} or TOOL=T0 …", line,
                          name.substr(0, 40), kMaxSheetTools - 1));
}

}  // namespace

Result<void> Interpreter::SetGcodeOffset(const Command& command) {
  Axes target = state_.machine;
  for (std::size_t axis = 0; axis < 3; ++axis) {
    const std::string key = kAxisKeys[axis];
    const auto set = TRY(NumberOf(command, key, kOffsetMm));
    const auto adjust = TRY(NumberOf(command, key + "_ADJUST", kOffsetMm));
    const double before = offsets_.shift()[axis];
    if (set.has_value()) {
      offsets_.SetGcodeOffset(static_cast<int>(axis), *set);
    } else {
      offsets_.AdjustGcodeOffset(static_cast<int>(axis), adjust.value_or(0));
    }
    target[axis] += offsets_.shift()[axis] - before;
  }
  return command.text_of("MOVE") == "1" ? GoTo(target, command.line) : Result<void>{};
}

// SET_TOOL_PARAMETER T=1 PARAMETER=gcode_x_offset VALUE=0.1, and SET_TOOL_OFFSET T=1 X=0.1.
Result<void> Interpreter::SetToolParameter(const Command& command) {
  const auto tool = TRY(NumberOf(command, "T", kToolNumber));
  int number = tool.has_value() ? static_cast<int>(*tool) : tool_;
  if (command.has("TOOL")) number = TRY(ToolNamed(command.text_of("TOOL"), command.line));
  for (int axis = 0; axis < 2; ++axis) {
    const std::string long_name = axis == 0 ? "GCODE_X_OFFSET" : "GCODE_Y_OFFSET";
    const bool meant = UpperCase(command.text_of("PARAMETER")) == long_name;
    const auto value = TRY(
        NumberOf(command, meant ? "VALUE" : kAxisKeys[static_cast<std::size_t>(axis)], kOffsetMm));
    if (value.has_value()) offsets_.Store(number, axis, *value);
  }
  return {};
}

// M218 T1 X0.1 Y0.2; without T, for the selected tool.
Result<void> Interpreter::SetHotendOffset(const Command& command) {
  if (setup_.firmware != SheetFirmware::kMarlin) {
    Ignore(command.name);
    return {};
  }
  return StoreXy(command, "T");
}

Result<void> Interpreter::StoreXy(const Command& command, const char* tool_key) {
  const auto tool = TRY(NumberOf(command, tool_key, kToolNumber));
  for (int axis = 0; axis < 2; ++axis) {
    const auto value = TRY(NumberOf(command, kAxisKeys[static_cast<std::size_t>(axis)], kOffsetMm));
    if (value.has_value()) {
      offsets_.Store(tool.has_value() ? static_cast<int>(*tool) : tool_, axis, *value);
    }
  }
  return {};
}

// G10 P1 X0.1 Y0.2, or with L1; without P and L it is a retraction, as on Marlin.
Result<void> Interpreter::SetToolOffset(const Command& command) {
  const bool offsets = command.has("P") || command.has("L");
  if (setup_.firmware != SheetFirmware::kRepRapFirmware || !offsets) {
    Ignore(command.name);
    return {};
  }
  TRY(NumberOf(command, "L", {1, 1}));
  return StoreXy(command, "P");
}

Result<void> Interpreter::ChangeTool(const Command& command, int tool, bool by_changer) {
  if (tool < 0 || tool >= kMaxSheetTools) {
    return Fail(fmt::format("G-code line {}: there is no tool {}; the virtual machine has 0 … {}",
                            command.line, tool, kMaxSheetTools - 1));
  }
  if (tool != tool_ || !tool_in_use_) ++pick_up_;
  tool_in_use_ = true;
  tool_ = tool;
  if (!has_carriages_) extruder_ = tool;
  Axes target = state_.machine;
  for (std::size_t axis = 0; axis < 3; ++axis) target[axis] -= offsets_.shift()[axis];
  offsets_.Select(tool, by_changer);
  for (std::size_t axis = 0; axis < 3; ++axis) target[axis] += offsets_.shift()[axis];
  // Marlin moves the new nozzle to the old one's position.
  const bool moves = setup_.firmware == SheetFirmware::kMarlin && !command.has("S");
  return moves ? GoTo(target, command.line) : Result<void>{};
}

Result<void> Interpreter::ActivateExtruder(const Command& command) {
  const std::string name = UpperCase(command.text_of("EXTRUDER")).substr(0, 40);
  const std::string_view digits =
      std::string_view(name).substr(std::min<std::size_t>(8, name.size()));
  const bool known = name.substr(0, 8) == "EXTRUDER" && digits.size() <= 1 &&
                     (digits.empty() || (digits[0] >= '1' && digits[0] <= '7'));
  if (!known) {
    return Fail(
        fmt::format("G-code line {}: there is no extruder '{}'; the virtual machine has "
                    "extruder, extruder1 … extruder7",
                    command.line, name));
  }
  extruder_ = digits.empty() ? 0 : digits[0] - '0';
  state_.base[3] = state_.machine[3];
  state_.extrude_factor = 1;
  return has_carriages_ ? Result<void>{} : ChangeTool(command, extruder_, false);
}

Result<void> Interpreter::SetDualCarriage(const Command& command) {
  const std::string mode = command.text_of("MODE", "PRIMARY");
  if (UpperCase(mode) != "PRIMARY") {
    return Fail(
        fmt::format("G-code line {}: SET_DUAL_CARRIAGE MODE={} is not understood by the "
                    "virtual machine; use PRIMARY",
                    command.line, mode.substr(0, 20)));
  }
  const auto carriage = TRY(NumberOf(command, "CARRIAGE", {0, 1}));
  if (!carriage.has_value()) {
    return Fail(
        fmt::format("G-code line {}: SET_DUAL_CARRIAGE needs CARRIAGE=0 or 1", command.line));
  }
  const auto next = static_cast<std::size_t>(*carriage);
  const auto before = static_cast<std::size_t>(tool_);  // a third tool rides on neither carriage
  if (!has_carriages_) parked_x_mm_.fill(state_.machine[0]);
  if (before < parked_x_mm_.size()) parked_x_mm_[before] = state_.machine[0];
  has_carriages_ = true;
  const auto changed = ChangeTool(command, static_cast<int>(next), false);
  state_.machine[0] = parked_x_mm_[next];
  return changed;
}

Result<void> Interpreter::SelectTool(const Command& command) {
  const auto by_number = TRY(NumberOf(command, "T", kToolNumber));
  if (by_number.has_value()) return ChangeTool(command, static_cast<int>(*by_number), true);
  const auto named = TRY(ToolNamed(command.text_of("TOOL"), command.line));
  return ChangeTool(command, named, true);
}

// Handles T0 … T7, T-1 and the templates of the setup. False: none of these.
Result<bool> Interpreter::RunToolCommand(const Command& command, std::string_view line) {
  const std::string text = UpperCase(line.substr(0, std::min(line.size(), line.find(';'))));
  const std::size_t last = text.find_last_not_of(" \t\r");
  for (const std::string& pattern : setup_.tool_commands) {
    for (int tool = 0; tool < kMaxSheetTools; ++tool) {
      const std::size_t at = pattern.find("{tool}");
      if (at == std::string::npos) break;
      const std::string wanted =
          fmt::format("{}{}{}", pattern.substr(0, at), tool, pattern.substr(at + 6));
      if (last == std::string::npos || text.substr(0, last + 1) != UpperCase(wanted)) continue;
      TRY(ChangeTool(command, tool, true));
      return true;
    }
  }
  const std::string& name = command.name;
  if (name == "T-1") {
    tool_in_use_ = false;
    return true;
  }
  const bool digits =
      name.size() >= 2 && name[0] == 'T' && std::all_of(name.begin() + 1, name.end(), [](char c) {
        return std::isdigit(static_cast<unsigned char>(c)) != 0;
      });
  if (!digits) return false;
  const int tool = name.size() > 4 ? 999 : std::stoi(name.substr(1));
  TRY(ChangeTool(command, tool, true));
  return true;
}

namespace {

constexpr Bound kCentreMm{-1e4, 1e4};
constexpr double kSagMm = 0.0005;      // of an arc below its chord
constexpr double kOffCircleMm = 0.05;  // permitted difference of an arc's two radii
constexpr double kSmallestMm = 0.01;
constexpr double kLongestChordRad = 0.35;

}  // namespace

Result<void> Interpreter::Arc(const Command& command) {
  if (setup_.firmware != SheetFirmware::kRepRapFirmware || command.has("R")) return Refuse(command);
  const Axes start = state_.machine;
  const Axes target = TRY(TargetOf(command, state_, shift(), state_.absolute_filament));
  const auto i = TRY(NumberOf(command, "I", kCentreMm));
  const auto j = TRY(NumberOf(command, "J", kCentreMm));
  const double centre_x = start[0] + i.value_or(0);
  const double centre_y = start[1] + j.value_or(0);
  const double radius = std::hypot(start[0] - centre_x, start[1] - centre_y);
  const double end_radius = std::hypot(target[0] - centre_x, target[1] - centre_y);
  if (radius < kSmallestMm || std::abs(radius - end_radius) > kOffCircleMm) {
    return Fail(
        fmt::format("G-code line {}: {} has radii of {:.4f} and {:.4f} mm at its ends; "
                    "they must agree within {} mm",
                    command.line, command.name, radius, end_radius, kOffCircleMm));
  }
  const double from = std::atan2(start[1] - centre_y, start[0] - centre_x);
  double sweep = std::atan2(target[1] - centre_y, target[0] - centre_x) - from;
  constexpr double kTurn = 2 * std::numbers::pi;
  if (command.name == "G3") {
    while (sweep <= 1e-9) sweep += kTurn;
  } else {
    while (sweep >= -1e-9) sweep -= kTurn;
  }
  const double chord_rad =
      std::min(kLongestChordRad, 2 * std::acos(std::max(0.0, 1 - kSagMm / radius)));
  const int chords = std::max(2, static_cast<int>(std::ceil(std::abs(sweep) / chord_rad)));
  for (int chord = 1; chord <= chords; ++chord) {
    const double share = static_cast<double>(chord) / chords;
    const double angle = from + share * sweep;
    const double r = radius + share * (end_radius - radius);
    Axes next = target;
    if (chord < chords) {
      next = {centre_x + r * std::cos(angle), centre_y + r * std::sin(angle),
              start[2] + share * (target[2] - start[2]), start[3] + share * (target[3] - start[3])};
    }
    const std::size_t before = program_.moves.size();
    TRY(GoTo(next, command.line));
    if (program_.moves.size() > before) program_.moves.back().arc = true;
  }
  return {};
}

}  // namespace trammel::sim::sheet
