// Correction of a measured offset: each firmware's own command, with its own sign.
#pragma once

#include <optional>
#include <string>
#include <string_view>
#include <vector>

namespace trammel::tool_offset {

/// Firmware that stores a tool's offset.
enum class OffsetFirmware {
  kKlipperTool,         ///< klipper-toolchanger's [tool]: SET_TOOL_PARAMETER, SAVE_TOOL_PARAMETER
  kKlipperGcodeOffset,  ///< SET_GCODE_OFFSET in the tool's own macro; IDEX, and changers by macros
  kMarlin,              ///< M218, kept by M500
  kRepRapFirmware,      ///< G10 P, kept by M500 P10
};

/// "klipper-tool", "klipper-gcode-offset", "marlin" or "reprapfirmware".
[[nodiscard]] std::string_view ToString(OffsetFirmware firmware);
/// Parses the name; absent if it is none of the above.
[[nodiscard]] std::optional<OffsetFirmware> ParseOffsetFirmware(std::string_view name);

/// Offset of a tool as its firmware stores it, with the firmware's own sign.
struct KeptOffset {
  double x_mm = 0;
  double y_mm = 0;
};

/// Computes the stored offset with which the tool's lines land on the reference tool's.
///
/// `dx` is the position of the tool's line minus that of the reference tool's for the same command.
/// Klipper adds its offset to every commanded position, so it decreases by dx. Marlin and
/// RepRapFirmware store the nozzle's position and move the head the other way, so theirs increases
/// by dx.
[[nodiscard]] KeptOffset Corrected(OffsetFirmware firmware, const KeptOffset& now, double dx_mm,
                                   double dy_mm);

/// Returns commands that set the offset until the next restart. Lines of G-code, without line ends;
/// micrometres. REQUIRES 0 <= tool <= 99 and finite offsets.
[[nodiscard]] std::vector<std::string> SetCommands(OffsetFirmware firmware, int tool,
                                                   const KeptOffset& offset);

/// Returns commands that store the offset permanently; empty if it is a line in the user's own
/// configuration.
[[nodiscard]] std::vector<std::string> SaveCommands(OffsetFirmware firmware, int tool);

/// Returns the remaining step, once for all tools, if no command of one tool stores its offset;
/// empty otherwise.
[[nodiscard]] std::string SaveAdvice(OffsetFirmware firmware, int tool, const KeptOffset& offset);

}  // namespace trammel::tool_offset
