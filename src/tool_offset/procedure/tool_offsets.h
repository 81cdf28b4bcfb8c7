// Setting a tool's offset on a printer with klipper-toolchanger.
#pragma once

#include <map>
#include <string>
#include <vector>

#include "base/result.h"
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

}  // namespace trammel::procedure
