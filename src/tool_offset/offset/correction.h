// What takes a measured offset out: each firmware's own command, with its own sign.
#pragma once

#include <optional>
#include <string>
#include <string_view>
#include <vector>

namespace trammel::tool_offset {

/// Who keeps a tool's offset.
enum class OffsetFirmware {
  kKlipperTool,         ///< klipper-toolchanger's [tool]: SET_TOOL_PARAMETER, SAVE_TOOL_PARAMETER
  kKlipperGcodeOffset,  ///< SET_GCODE_OFFSET in the tool's own macro; IDEX, and changers by macros
  kMarlin,              ///< M218, kept by M500
  kRepRapFirmware,      ///< G10 P, kept by M500 P10
};

/// "klipper-tool", "klipper-gcode-offset", "marlin" or "reprapfirmware".
[[nodiscard]] std::string_view ToString(OffsetFirmware firmware);
/// Absent where the name is none of the above.
[[nodiscard]] std::optional<OffsetFirmware> ParseOffsetFirmware(std::string_view name);

/// A tool's offset as its firmware keeps it, in the firmware's own sense.
struct KeptOffset {
  double x_mm = 0;
  double y_mm = 0;
};

/// The kept offset with which the tool's lines land where the reference tool's do.
///
/// `dx` is where the tool's line lands minus where the reference tool's would for the same command.
/// Klipper adds its offset to every commanded position, so that it falls by dx. Marlin and
/// RepRapFirmware keep where the tool's nozzle is and move the head the other way, so that theirs
/// grows by dx.
[[nodiscard]] KeptOffset Corrected(OffsetFirmware firmware, const KeptOffset& now, double dx_mm,
                                   double dy_mm);

/// Sets it until the next restart. Lines of G-code, without line ends; micrometres.
/// REQUIRES 0 <= tool <= 99 and finite offsets.
[[nodiscard]] std::vector<std::string> SetCommands(OffsetFirmware firmware, int tool,
                                                   const KeptOffset& offset);

/// Keeps it beyond that; empty where it is a line in the user's own configuration.
[[nodiscard]] std::vector<std::string> SaveCommands(OffsetFirmware firmware, int tool);

/// What is left to do, once for all tools, where no command of one tool keeps its offset; empty
/// otherwise.
[[nodiscard]] std::string SaveAdvice(OffsetFirmware firmware, int tool, const KeptOffset& offset);

}  // namespace trammel::tool_offset
