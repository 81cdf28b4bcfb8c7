// Interprets G-code as a machine with several tools does: each nozzle's moves and extrusion. Speeds
// do not matter on a sheet of paper.
#pragma once

#include <array>
#include <map>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "base/result.h"
#include "sim/sheet/sheet_firmware.h"

namespace trammel::sim {

constexpr int kMaxSheetTools = 8;

/// Point or shift on the bed or on the sheet.
struct PlaneMm {
  double x_mm = 0;
  double y_mm = 0;
};

enum class SheetFirmware { kKlipper, kMarlin, kRepRapFirmware };

/// "klipper", "marlin" or "reprapfirmware".
[[nodiscard]] std::string_view ToString(SheetFirmware firmware);

/// Inverts ToString, and accepts "rrf". Error (kInput): an unknown name; the message lists the
/// known ones.
[[nodiscard]] Result<SheetFirmware> ParseSheetFirmware(std::string_view name);

/// Guesses a file's firmware: the only one that its comments name, else by its commands (KEY=VALUE
/// commands: Klipper; M218: Marlin; G10 P, M568, M563: RepRapFirmware), else Klipper.
[[nodiscard]] SheetFirmware GuessSheetFirmware(std::string_view gcode);

/// State of a machine before the first command; tool 0 is selected.
struct SheetSetup {
  SheetFirmware firmware = SheetFirmware::kKlipper;
  /// Offsets stored in the firmware per tool, in its own sign: gcode_x_offset of Klipper's
  /// toolchanger extension (acts when the tool is selected by T or SELECT_TOOL), Marlin's M218,
  /// RepRapFirmware's G10. mm, +-1000. Klipper: has the extension if any is set.
  std::array<std::optional<PlaneMm>, kMaxSheetTools> stored{};
  SheetMacros macros;  ///< Klipper's gcode_macros
  /// Further commands that select a tool, with "{tool}" for its number.
  std::vector<std::string> tool_commands;
  std::string before;  ///< G-code that it has run before the file
  /// Klipper: has [pause_resume]. Without it there is no PAUSE, and Klipper continues.
  bool pause_resume = true;
};

/// Straight move of the machine with all the firmware's offsets, in machine coordinates: the
/// nozzle's position if the firmware's belief were exact.
struct SheetMove {
  int line = 0;     ///< line of the file, from 1
  int tool = 0;     ///< 0 … 7
  int pick_up = 0;  ///< counts tool changes
  int x_drive = 0;  ///< carriage index if a machine has two in x
  PlaneMm from;
  PlaneMm to;
  double z_mm = 0;   ///< the higher end
  double e_mm = 0;   ///< filament, positive forward
  bool arc = false;  ///< a chord of an arc
  PlaneMm shift;     ///< firmware's part of the position: tool offsets and SET_GCODE_OFFSET
};

struct SheetProgram {
  std::vector<SheetMove> moves;
  /// Unknown commands by name, with their count; not those that never move a tool (temperatures,
  /// fans, speeds, waiting).
  std::map<std::string, int> ignored;
};

/// Interprets a file in the arithmetic of one firmware: modes (G90 and G91 also switch the extruder
/// on Marlin, and on Klipper unless M83), G92, G28, saved states, M221, tool changes (T,
/// ACTIVATE_EXTRUDER, SET_DUAL_CARRIAGE, SELECT_TOOL, templates, macros), and offsets:
/// SET_GCODE_OFFSET and SET_TOOL_PARAMETER (position = command + offset), M218 and G10 (position =
/// command - offset; M218 acts with the next tool change, G10 at once).
/// Errors (kInput) state the line and the value: malformed numbers, positions beyond +-10 m, arcs
/// (except on RepRapFirmware: with I and J), inches, volumetric extrusion, copy and mirror modes,
/// tools beyond 7, an extruder that extrudes while another carriage is active, macros nested deeper
/// than 10, more than a million moves. Lines of setup.before are counted separately, and errors
/// name them.
[[nodiscard]] Result<SheetProgram> InterpretSheet(std::string_view gcode, const SheetSetup& setup);

}  // namespace trammel::sim
