// Differences between firmwares, in one table. All other G-code of trammel is common to all.
#pragma once

#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "base/result.h"

namespace trammel::gcode {

enum class Dialect { kKlipper, kMarlin, kRepRapFirmware, kPrusa, kBambu };

/// Words of a firmware. Texts of several lines have a line end between lines; those of G-code may
/// have {placeholders}.
struct FirmwareWords {
  Dialect dialect = Dialect::kKlipper;
  std::string_view name;   ///< in trammel.toml and on the command line
  std::string_view title;  ///< for people
  /// Sets the pressure advance: {value} in s, {drive} of AdvanceMotors.
  std::string_view advance;
  std::string_view advance_of_motor;  ///< the same of one {motor}; empty: there is none
  std::string_view advance_note;      ///< meaning of a parameter, for people; empty: none
  double max_advance_s = 0;           ///< the highest that the command accepts
  std::string_view keep;              ///< place that keeps the value, for people
  std::string_view transfer;       ///< way of a file to the printer, for people; empty: as any file
  std::string_view modes;          ///< sets units, coordinates, E and factors; switches the fan off
  bool relative_filament = false;  ///< E of moves, by `modes`
  std::string_view acceleration;   ///< limits printing and travelling moves to {acceleration}
  std::string_view save_state;     ///< SaveStateCommands
  std::string_view restore_state;  ///< RestoreStateCommands
  std::string_view display;        ///< shows the text behind it; empty: the firmware has no such
  std::string_view start_gcode;    ///< default: heats and homes
  std::string_view end_gcode;      ///< default: switches heaters off
  bool cutter_in_corner = false;   ///< front left of the bed, where the nozzle must not wait
  bool writes_tool_offsets = false;  ///< the sheet of several tools is written for it
};

/// Returns all firmwares, in the order of Dialect.
[[nodiscard]] std::span<const FirmwareWords> Firmwares();
[[nodiscard]] const FirmwareWords& WordsOf(Dialect dialect);

/// Returns FirmwareWords::name.
[[nodiscard]] std::string_view ToString(Dialect dialect);
/// Absent if the name is none of Firmwares().
[[nodiscard]] std::optional<Dialect> ParseDialect(std::string_view name);
/// Returns all names for a message: "klipper, marlin … or bambu", each between `quote`.
[[nodiscard]] std::string DialectNames(std::string_view quote = "");

/// Resolution of pressure advance in G-code: 1e-5 s, finer than any firmware or filament resolves.
inline constexpr int kPressureAdvanceDecimals = 5;

/// Motors whose pressure advance is set.
struct AdvanceMotors {
  std::vector<std::string> names;  ///< Klipper: EXTRUDER= of each; empty: the active extruder's own
  int drive = 0;                   ///< RepRapFirmware: D of M572
};

/// Returns the commands that set the pressure advance in seconds, or the K of Marlin and Bambu,
/// which has the same dimension, on each of the motors. Lines, without line ends.
[[nodiscard]] std::vector<std::string> PressureAdvanceCommands(Dialect dialect,
                                                               double pressure_advance_s,
                                                               const AdvanceMotors& motors = {});
/// Returns the same for a value as displayed.
[[nodiscard]] std::vector<std::string> PressureAdvanceCommands(Dialect dialect,
                                                               std::string_view value,
                                                               const AdvanceMotors& motors = {});

/// Firmware of a print, whose command sets a value measured on that print.
struct PrintedBy {
  Dialect dialect = Dialect::kKlipper;
  int drive = 0;  ///< RepRapFirmware's; 0 elsewhere

  bool operator==(const PrintedBy&) const = default;
};

/// Last tool that G-code selects by a line T0, T1, …
struct SelectedTool {
  std::optional<int> number;  ///< absent: no line selects one, or `unknown` does
  std::string unknown;  ///< a line that may select a tool that cannot be known: "M98 P\"a.g\""
};
[[nodiscard]] SelectedTool ToolSelectedBy(std::string_view gcode);

/// Returns the command that sets the acceleration of printing and travelling moves and, in [0, 1),
/// the minimum share of a move that Klipper cruises. The share is set as minimum_cruise_ratio and
/// as ACCEL_TO_DECEL, its name before 2024, which later versions ignore. Other firmwares have none.
/// An absent share is unchanged.
[[nodiscard]] std::string LimitCommand(Dialect dialect, double acceleration_mm_s2,
                                       std::optional<double> minimum_cruise_ratio);

/// Returns FirmwareWords::modes. Lines, without line ends.
[[nodiscard]] std::vector<std::string> ModeCommands(Dialect dialect);

/// Returns the commands that save and restore the positioning modes (absolute or relative, G92
/// offsets). The name is the pattern's own, since the surrounding print may save its state too. On
/// Klipper also limits and pressure advance, by macros of klipper/trammel.cfg; without that file
/// Klipper reports unknown commands and continues. Empty if the firmware has no such command.
[[nodiscard]] std::vector<std::string> SaveStateCommands(Dialect dialect);
[[nodiscard]] std::vector<std::string> RestoreStateCommands(Dialect dialect);

/// Setting that a file changes.
struct ChangedSetting {
  std::string_view words;      ///< "pressure advance"
  double left = 0;             ///< final value, unless restored
  std::optional<double> back;  ///< value restored at the end; absent: not restored
  std::string_view key;        ///< key in trammel.toml that sets `back`
};

/// Describes the settings that remain changed after the print.
[[nodiscard]] std::string DescribeAfterwards(Dialect dialect,
                                             const std::vector<ChangedSetting>& changed);

/// Waits until the planned moves have been executed: M400 in all dialects.
[[nodiscard]] std::string WaitForMovesCommand();

/// Shows a line of text on the display, and clears it with an empty one; no line where the firmware
/// has no such command. Line ends and control characters become blanks, so that text cannot become
/// a command.
[[nodiscard]] std::vector<std::string> DisplayCommands(Dialect dialect, std::string_view text);

// Formats numbers for G-code: short, and the same on every machine.

/// Rounds to `decimals` places and drops trailing zeros: 1.500 -> "1.5", -0.0001 -> "0" at 3.
/// Never scientific, never "-0", independent of the locale. REQUIRES a finite value with
/// |value| < 1e12 and 0 <= decimals <= 9.
[[nodiscard]] std::string FormatNumber(double value, int decimals);

// {name} in the user's own G-code.

struct Placeholder {
  std::string name;   ///< without braces
  std::string value;  ///< replacement text
};

/// Replaces `{name}` by values; `{{` and `}}` are single braces. Values are not expanded again.
/// Errors: an unknown name (lists the known ones), an unmatched brace (names the line).
[[nodiscard]] Result<std::string> ExpandPlaceholders(std::string_view text,
                                                     std::span<const Placeholder> known);

// Commands for machines with several tools.

/// Sets a tool's temperature without waiting, mounted or not; 0 switches it off.
[[nodiscard]] std::string ToolTemperatureCommand(Dialect dialect, int tool, double temperature_c);

/// Sets a tool's temperature and waits for it. Lines, without line ends.
[[nodiscard]] std::vector<std::string> HeatToolCommands(Dialect dialect, int tool,
                                                        double temperature_c);

/// Switches the bed off and waits until it is no warmer than this. Lines, without line ends.
[[nodiscard]] std::vector<std::string> CoolBedCommands(Dialect dialect, double at_most_c);

/// Switches a tool off and waits until it is no warmer than this. Lines, without line ends.
[[nodiscard]] std::vector<std::string> CoolToolCommands(Dialect dialect, int tool,
                                                        double at_most_c);

/// Shows a text and waits until the user resumes. Quotes and control characters in it become
/// blanks. A Klipper without [pause_resume], which would continue, ends the print with an error
/// instead. Lines, without line ends.
[[nodiscard]] std::vector<std::string> PauseCommands(Dialect dialect, std::string_view text);

/// Returns Klipper's name of a tool's extruder: "extruder", "extruder1", …
[[nodiscard]] std::string KlipperExtruder(int tool);

}  // namespace trammel::gcode
