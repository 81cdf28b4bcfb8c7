// Reads and sets the offsets of a printer's tools.
#pragma once

#include <map>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "base/result.h"
#include "machine/moonraker/printer_facts.h"
#include "session/checks.h"
#include "session/session.h"
#include "tool_offset/offset/correction.h"

namespace trammel::procedure {

/// [tool] of klipper-toolchanger.
struct KlipperTool {
  std::string extruder;  ///< tool's own; empty: none
  tool_offset::KeptOffset kept;
};

/// Returns the numbers of klipper-toolchanger's tools; none without klipper-toolchanger.
[[nodiscard]] Result<std::vector<int>> ToolNumbers(const Session& session);

/// Reads a tool from klipper-toolchanger. Errors: as ReadToolOffset.
[[nodiscard]] Result<KlipperTool> ReadTool(const Session& session, int tool);

/// Reads the tool's present offset on the printer. klipper-toolchanger maps the number to a [tool].
/// Errors (kMachine): unreachable; no such tool, with the numbers of those there.
[[nodiscard]] Result<tool_offset::KeptOffset> ReadToolOffset(const Session& session, int tool);

/// Sets the offset until the next restart, reads it back and compares. Errors (kMachine): the
/// printer prints, refuses the command, or reports another value.
[[nodiscard]] Result<void> SetToolOffset(const Session& session, int tool,
                                         const tool_offset::KeptOffset& offset);

/// Writes the set offsets into the printer's configuration. SAVE_CONFIG restarts the firmware:
/// homing and temperatures are lost. Waits for it and reads the offsets back. Errors (kMachine):
/// the printer prints; a [tool] is in an included file, which SAVE_CONFIG does not change; the
/// printer does not return, or with another value.
[[nodiscard]] Result<void> KeepToolOffsets(const Session& session,
                                           const std::map<int, tool_offset::KeptOffset>& offsets);

/// True if two offsets agree to the micrometre, the resolution of the commands.
[[nodiscard]] bool SameOffset(const tool_offset::KeptOffset& a, const tool_offset::KeptOffset& b);

/// Owner of the tools' offsets on a printer with Klipper.
enum class ToolKeeper {
  kToolchanger,   ///< klipper-toolchanger's [tool]: told, and can be set
  kDualCarriage,  ///< [dual_carriage], with a name or without: nobody; they stand in the user's own
                  ///< T macros
  kMacros,        ///< [gcode_macro T0], ...: the same
  kExtruders,     ///< several [extruder]s, and no T macros
};

struct PrinterTool {
  int number = 0;
  std::string extruder;                              ///< Klipper's name
  std::optional<tool_offset::KeptOffset> kept = {};  ///< absent: Klipper does not tell
};

struct PrinterTools {
  ToolKeeper keeper = ToolKeeper::kToolchanger;
  std::vector<PrinterTool> tools;    ///< sorted by number
  std::vector<std::string> notices;  ///< unexpected properties of this printer
  std::vector<machine::DualCarriage> carriages = {};

  [[nodiscard]] bool can_be_set() const { return keeper == ToolKeeper::kToolchanger; }
  [[nodiscard]] const PrinterTool* Find(int number) const;
};

/// Explains why offsets can neither be read nor set on such a printer, and what to do; empty if
/// they can.
[[nodiscard]] std::string WhyNotSet(ToolKeeper keeper);

/// Returns the default G-code that picks up "{tool}" on this printer: T{tool} or
/// klipper-toolchanger's SELECT_TOOL, ACTIVATE_EXTRUDER, or SET_DUAL_CARRIAGE with it. Errors: the
/// printer's; kSafety if carriages have names, which only a macro can select by tool.
[[nodiscard]] Result<std::string> UsualToolChange(const Session& session,
                                                  const PrinterTools& tools);

/// Checks that such G-code activates the tool's carriage, if there are several: the wrong one would
/// draw. @param gcode  with {tool}, not expanded
[[nodiscard]] Check CheckCarriages(const PrinterTools& tools, const std::string& gcode);

/// Reads all tools. Errors (kMachine): unreachable; one tool alone; tools without number or with
/// absurd offsets.
[[nodiscard]] Result<PrinterTools> ReadTools(const Session& session);

}  // namespace trammel::procedure
