// State machine of InterpretSheet, in its own header because two files implement it.
#pragma once

#include <array>
#include <map>
#include <string>
#include <string_view>
#include <utility>

#include "sim/gcode/command.h"
#include "sim/gcode/modes.h"
#include "sim/sheet/sheet_gcode.h"
#include "sim/sheet/sheet_tool_offsets.h"

namespace trammel::sim::sheet {

inline constexpr Bound kToolNumber{0, kMaxSheetTools - 1};

// State that Klipper's SAVE_GCODE_STATE saves.
struct State : Modes {
  SheetToolOffsets::Shift shift{};
};

class Interpreter {
 public:
  explicit Interpreter(const SheetSetup& setup) : setup_(setup), offsets_(setup) {
    for (std::size_t axis = 0; axis < 3; ++axis) state_.machine[axis] = offsets_.shift()[axis];
  }

  Result<void> Run(std::string_view line, int number, int depth);
  SheetProgram Take() { return std::move(program_); }

 private:
  using Handler = Result<void> (Interpreter::*)(const Command&);
  static const std::map<std::string, Handler, std::less<>>& Handlers();

  bool klipper() const { return setup_.firmware == SheetFirmware::kKlipper; }
  Axes shift() const {
    const SheetToolOffsets::Shift& mm = offsets_.shift();
    return {mm[0], mm[1], mm[2], 0};
  }

  Result<void> RunMacro(const std::string& text, int number, int depth);
  Result<bool> RunToolCommand(const Command& command, std::string_view line);
  Result<void> ChangeTool(const Command& command, int tool, bool by_changer);
  Result<void> GoTo(const Axes& target, int line);
  void Ignore(const std::string& name);

  Result<void> Linear(const Command& command);
  Result<void> Arc(const Command& command);
  Result<void> Refuse(const Command& command);
  Result<void> HomeAxes(const Command& command);
  Result<void> SetOrigin(const Command& command);
  Result<void> SetModes(const Command& command);
  Result<void> SetExtrudeFactor(const Command& command);
  Result<void> SetVolumetric(const Command& command);
  Result<void> SaveState(const Command& command);
  Result<void> RestoreState(const Command& command);
  Result<void> Pause(const Command& command);
  Result<void> SetGcodeOffset(const Command& command);
  Result<void> SetToolParameter(const Command& command);
  Result<void> SetHotendOffset(const Command& command);
  Result<void> SetToolOffset(const Command& command);
  // X and Y of a command as offsets of the tool that a key names, or of the tool in use.
  Result<void> StoreXy(const Command& command, const char* tool_key);
  Result<void> ActivateExtruder(const Command& command);
  Result<void> SetDualCarriage(const Command& command);
  Result<void> SelectTool(const Command& command);

  const SheetSetup& setup_;
  SheetProgram program_;
  SheetToolOffsets offsets_;
  Modes state_;
  std::map<std::string, State> saved_;
  bool tool_in_use_ = true;
  int tool_ = 0;
  int extruder_ = 0;
  bool has_carriages_ = false;
  std::array<double, 2> parked_x_mm_{};  // per carriage
  int pick_up_ = 0;
  int commands_ = 0;
};

}  // namespace trammel::sim::sheet
