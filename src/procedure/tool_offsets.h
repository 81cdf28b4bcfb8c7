// Setting a tool's offset on a printer with klipper-toolchanger.
#pragma once

#include <vector>

#include "base/result.h"
#include "procedure/session.h"
#include "tool_offset/correction.h"

namespace trammel::procedure {

/// The tool's offset as the printer keeps it now (object "tool T<number>", or the tool whose
/// tool_number it is). Errors (kMachine): unreachable; no such tool, with the names of those there.
[[nodiscard]] Result<tool_offset::KeptOffset> ReadToolOffset(const Session& session, int tool);

/// Sets it, reads it back and compares; keeps it beyond a restart where `save`.
/// Errors (kMachine): the printer prints, refuses the command, or reports another value.
[[nodiscard]] Result<void> SetToolOffset(const Session& session, int tool,
                                         const tool_offset::KeptOffset& offset, bool save);

}  // namespace trammel::procedure
