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

/// A [tool] of klipper-toolchanger.
struct KlipperTool {
  std::string extruder;  ///< its own; empty: none
  tool_offset::KeptOffset kept;
};

/// The numbers of klipper-toolchanger's tools; none where there is no such thing.
[[nodiscard]] Result<std::vector<int>> ToolNumbers(const Session& session);

/// A tool as klipper-toolchanger tells of it. Errors: as ReadToolOffset.
[[nodiscard]] Result<KlipperTool> ReadTool(const Session& session, int tool);

/// The tool's offset as the printer keeps it now. Which [tool] has the number, klipper-toolchanger
/// tells. Errors (kMachine): unreachable; no such tool, with the numbers of those there.
[[nodiscard]] Result<tool_offset::KeptOffset> ReadToolOffset(const Session& session, int tool);

/// Sets it until the next restart, reads it back and compares.
/// Errors (kMachine): the printer prints, refuses the command, or reports another value.
[[nodiscard]] Result<void> SetToolOffset(const Session& session, int tool,
                                         const tool_offset::KeptOffset& offset);

/// Writes what was set into the printer's configuration. SAVE_CONFIG restarts the firmware: what
/// was homed and hot is not any more. Waits for it and reads the offsets back. Errors (kMachine):
/// the printer prints; a [tool] stands in an included file, which SAVE_CONFIG does not change; the
/// printer does not come back, or with another value.
[[nodiscard]] Result<void> KeepToolOffsets(const Session& session,
                                           const std::map<int, tool_offset::KeptOffset>& offsets);

/// Whether two offsets are the same as far as a firmware is told: to the micrometre.
[[nodiscard]] bool SameOffset(const tool_offset::KeptOffset& a, const tool_offset::KeptOffset& b);

/// Who keeps the tools' offsets on a printer with Klipper.
enum class ToolKeeper {
  kToolchanger,   ///< klipper-toolchanger's [tool]: told, and can be set
  kDualCarriage,  ///< [dual_carriage], with a name or without: nobody; they stand in the user's own
                  ///< T macros
  kMacros,        ///< [gcode_macro T0], ...: the same
  kExtruders,     ///< several [extruder]s, and no T macros
};

struct PrinterTool {
  int number = 0;
  std::string extruder;                              ///< as Klipper names it
  std::optional<tool_offset::KeptOffset> kept = {};  ///< absent: Klipper does not tell
};

struct PrinterTools {
  ToolKeeper keeper = ToolKeeper::kToolchanger;
  std::vector<PrinterTool> tools;    ///< by rising number
  std::vector<std::string> notices;  ///< what this printer does otherwise than one might think
  std::vector<machine::DualCarriage> carriages = {};

  [[nodiscard]] bool can_be_set() const { return keeper == ToolKeeper::kToolchanger; }
  [[nodiscard]] const PrinterTool* Find(int number) const;
};

/// Why offsets can neither be read nor set on such a printer, and what can be done; empty where
/// they can.
[[nodiscard]] std::string WhyNotSet(ToolKeeper keeper);

/// The G-code that picks up "{tool}" there, where the user has none of their own: T{tool} or
/// klipper-toolchanger's SELECT_TOOL, ACTIVATE_EXTRUDER, or SET_DUAL_CARRIAGE with it. Errors: the
/// printer's; kSafety where carriages have names, which only a macro can choose by tool.
[[nodiscard]] Result<std::string> UsualToolChange(const Session& session,
                                                  const PrinterTools& tools);

/// That such G-code brings the tool's carriage along, where there are several: the wrong one would
/// draw. @param gcode  with {tool}, not expanded
[[nodiscard]] Check CheckCarriages(const PrinterTools& tools, const std::string& gcode);

/// Errors (kMachine): unreachable; one tool alone; tools without number or with absurd offsets.
[[nodiscard]] Result<PrinterTools> ReadTools(const Session& session);

}  // namespace trammel::procedure
