// Which tools a printer has, who keeps their offsets, and what they are now.
#pragma once

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
