// What differs between firmwares. Everything else that trammel writes is G-code common to all.
#pragma once

#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "base/result.h"

namespace trammel::gcode {

enum class Dialect { kKlipper, kMarlin, kRepRapFirmware };

/// "klipper", "marlin" or "reprapfirmware", as in trammel.toml.
[[nodiscard]] std::string_view ToString(Dialect dialect);
/// Absent where the name is none of the above.
[[nodiscard]] std::optional<Dialect> ParseDialect(std::string_view name);

/// Pressure advance is written in steps of 1e-5 s, finer than any firmware or filament tells.
inline constexpr int kPressureAdvanceDecimals = 5;

/// The motors whose pressure advance is set.
struct AdvanceMotors {
  std::vector<std::string> names;  ///< Klipper: EXTRUDER= of each; empty: the active extruder's own
  int drive = 0;                   ///< RepRapFirmware: D of M572
};

/// Sets the pressure advance in seconds (Klipper, RepRapFirmware) or Marlin's K, which has the same
/// dimension, on each of the motors. Lines, without line ends.
[[nodiscard]] std::vector<std::string> PressureAdvanceCommands(Dialect dialect,
                                                               double pressure_advance_s,
                                                               const AdvanceMotors& motors = {});
/// The same for a value as it is shown to people.
[[nodiscard]] std::vector<std::string> PressureAdvanceCommands(Dialect dialect,
                                                               std::string_view value,
                                                               const AdvanceMotors& motors = {});

/// The firmware that printed something, by whose command a value measured there is set.
struct PrintedBy {
  Dialect dialect = Dialect::kKlipper;
  int drive = 0;  ///< RepRapFirmware's; 0 elsewhere

  bool operator==(const PrintedBy&) const = default;
};

/// Finds the tool that G-code selects last by a line T0, T1, …
struct SelectedTool {
  std::optional<int> number;  ///< absent: no line selects one, or `unknown` does
  std::string unknown;  ///< a line that may select a tool that cannot be known: "M98 P\"a.g\""
};
[[nodiscard]] SelectedTool ToolSelectedBy(std::string_view gcode);

/// Sets the acceleration of printing and travelling moves and, in [0, 1), the share of a move that
/// Klipper cruises at least: as minimum_cruise_ratio and as ACCEL_TO_DECEL, by which a Klipper
/// before 2024 knows it and which later ones ignore beside it. Other firmwares have none. An absent
/// share is left as it is.
[[nodiscard]] std::string LimitCommand(Dialect dialect, double acceleration_mm_s2,
                                       std::optional<double> minimum_cruise_ratio);

/// Keeps and brings back the modes of positioning (absolute or relative, G92 offsets), under a name
/// of the pattern alone: whoever prints it may keep a state of its own. On Klipper limits and
/// pressure advance, too, by macros of klipper/trammel.cfg; without that file Klipper says that it
/// does not know them, and goes on. Empty where the firmware has no such command.
[[nodiscard]] std::vector<std::string> SaveStateCommands(Dialect dialect);
[[nodiscard]] std::vector<std::string> RestoreStateCommands(Dialect dialect);

/// A setting that a file changes.
struct ChangedSetting {
  std::string_view words;      ///< "pressure advance"
  double left = 0;             ///< what the file leaves it at
  std::optional<double> back;  ///< what the file sets it to in the end; absent: it is left
  std::string_view key;        ///< of trammel.toml: sets `back`
};

/// What such a file leaves behind once it is printed, in a sentence.
[[nodiscard]] std::string DescribeAfterwards(Dialect dialect,
                                             const std::vector<ChangedSetting>& changed);

/// Waits until the planned moves have been carried out: M400 everywhere.
[[nodiscard]] std::string WaitForMovesCommand();

/// Shows a line of text on the display: M117 everywhere. Line ends and control characters become
/// blanks, so that a text can never become a command.
[[nodiscard]] std::string DisplayCommand(std::string_view text);

// Numbers as G-code carries them: short, and the same on every machine.

/// Rounds to `decimals` places and drops trailing zeros: 1.500 -> "1.5", -0.0001 -> "0" at 3.
/// Never scientific, never "-0", independent of the locale. REQUIRES a finite value with
/// |value| < 1e12 and 0 <= decimals <= 9.
[[nodiscard]] std::string FormatNumber(double value, int decimals);

// {name} in the user's own G-code.

struct Placeholder {
  std::string name;   ///< without braces
  std::string value;  ///< what stands in its place
};

/// Puts values for `{name}`; `{{` and `}}` stand for single braces. Values are not expanded again.
/// Errors: an unknown name (lists the known ones), a brace without its partner (says which line).
[[nodiscard]] Result<std::string> ExpandPlaceholders(std::string_view text,
                                                     std::span<const Placeholder> known);

// Commands for machines with several tools.

/// Sets a tool's temperature without waiting, whether it is picked up or not; 0 switches it off.
[[nodiscard]] std::string ToolTemperatureCommand(Dialect dialect, int tool, double temperature_c);

/// Sets a tool's temperature and waits for it. Lines, without line ends.
[[nodiscard]] std::vector<std::string> HeatToolCommands(Dialect dialect, int tool,
                                                        double temperature_c);

/// Switches the bed off and waits until it is no warmer than this. Lines, without line ends.
[[nodiscard]] std::vector<std::string> CoolBedCommands(Dialect dialect, double at_most_c);

/// Switches a tool off and waits until it is no warmer than this. Lines, without line ends.
[[nodiscard]] std::vector<std::string> CoolToolCommands(Dialect dialect, int tool,
                                                        double at_most_c);

/// Shows a text and waits until somebody says to go on. Quotes and control characters in it become
/// blanks. A Klipper without [pause_resume], which would run on, ends the print with an error
/// instead. Lines, without line ends.
[[nodiscard]] std::vector<std::string> PauseCommands(Dialect dialect, std::string_view text);

/// The extruder that belongs to a tool, as Klipper names it: "extruder", "extruder1", …
[[nodiscard]] std::string KlipperExtruder(int tool);

}  // namespace trammel::gcode
