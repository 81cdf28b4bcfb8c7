// What differs between firmwares. Everything else that trammel writes is G-code common to all.
#pragma once

#include <optional>
#include <string>
#include <string_view>
#include <vector>

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

}  // namespace trammel::gcode
