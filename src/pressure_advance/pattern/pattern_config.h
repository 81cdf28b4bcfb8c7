// Every setting of the printed pressure-advance pattern.
#pragma once

#include <cstddef>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "base/result.h"
#include "gcode/dialect.h"
#include "pressure_advance/profile/line_profile.h"
#include "settings/printer.h"
#include "settings/scan_settings.h"
#include "settings/setting.h"

namespace trammel::pressure_advance {

inline constexpr const char* kDefaultIdleGcode = "M104 S{idle_nozzle_temperature_c}\n";

enum class Finish {
  kEnd,   ///< the end G-code: by default everything off
  kIdle,  ///< the idle G-code: the bed stays warm and holds the pattern for a scan
};

/// Conditions of a pattern, if those of one plate differ.
struct PatternConditions {
  double fast_speed_mm_s = 0;     ///< [0.1, 1000], of the fastest segments
  double acceleration_mm_s2 = 0;  ///< [1, 1e6]
};

/// Settings of the printer and the filament (settings/printer.h), and this pattern's own.
///
/// PatternFields() has the ranges of single fields and their documentation. Validate() checks those
/// and the combination of fields.
/// "Paper": Abbott, Automatic Pressure Advance Calibration Using Laser Triangulation, and its
/// released code, which takes precedence where the two differ.
struct PatternConfig : settings::PrinterSettings, settings::FilamentSettings {
  // End of a print.
  std::string idle_gcode = kDefaultIdleGcode;
  Finish finish = Finish::kEnd;                      ///< safe where nobody is watching
  std::optional<double> restore_pressure_advance_s;  ///< [0, 10]; set at the end; absent: left at …
                                                     ///< … frame_pressure_advance_s
  double restore_minimum_cruise_ratio = 0.5;  ///< [0, 1); Klipper's own default
  int extruder_drive = -1;                    ///< [-1, 31]; RepRapFirmware's D of M572; -1: DriveOf
  /// Klipper: EXTRUDER= of the motors that push the filament; empty: the active extruder's own. Not
  /// a setting: read from the printer.
  std::vector<std::string> advance_motors = {};
  double pressure_advance_limit_s = 0.2;  ///< [0.001, 2]; what is applied without being forced:
                                          ///< the reach of Klipper's tuning tower, direct drive

  // The pattern.
  std::string preset;  ///< preset of the other values (PatternPreset); empty: the paper's
  std::optional<double> position_x_mm;   ///< front left corner of the first frame's outer edge; …
  std::optional<double> position_y_mm;   ///< … absent: everything is centred on the bed
  double pressure_advance_start_s = 0;   ///< [0, 10]; paper
  double pressure_advance_end_s = 0.06;  ///< [0, 10], above the start; paper
  int line_count = 10;                   ///< [2, 200]; paper
  std::vector<double> pressure_advances_s;  ///< explicit values instead of the range; no two equal
  /// Pressure advance of the second half of the lines, the first half without it: the paper's
  /// check. Not a setting: set by pa validate.
  std::optional<double> validated_pressure_advance_s;
  double line_length_mm = 30;  ///< (0, 2000]; paper
  double line_spacing_mm = 4;  ///< (0, 200], above a bead's width; paper
  std::vector<Segment> segments = {{0.25, 5}, {0.5, 150}, {0.25, 5}};  ///< paper
  double acceleration_mm_s2 = 3000;                                    ///< [1, 1e6]; paper
  double layer_height_mm = 0.25;                                       ///< [0.02, 2]; paper's code
  double line_width_mm = 0.495;       ///< [0.05, 4]; gives the paper's 0.0459 mm of filament per mm
  bool alternate_directions = false;  ///< every other line from the far end
  int frame_loops = 2;                ///< [0, 20] nested loops round the lines; paper
  double frame_overlap_mm = 0.15;  ///< [-50, 4]; how far a line's round end runs into the frame's
                                   ///< bead: enough to lift off in one piece, without a blob.
                                   ///< Negative: a gap. The paper's is the line width.
  std::optional<double> frame_margin_mm;  ///< (0, 200] between the outermost line's and the frame's
                                          ///< centre lines; absent: what the corner mark …
                                          ///< … needs, without one the line spacing (paper)
  bool corner_mark = false;      ///< the frame's corner beside the first line's start is filled, so
                                 ///< that a photo shows which way it lies
  double frame_speed_mm_s = 33;  ///< (0, 500]; paper: F2000
  double frame_pressure_advance_s = 0;  ///< [0, 10]; the frame runs at one speed and needs none
  double prime_length_mm = 0.5;         ///< [0, 50] of filament before each frame; paper
  bool lift_between_lines = true;       ///< z_hop on the way to a line; else only to the first one
  std::optional<double> approach_lift_mm;  ///< [0.5, 200] above the layer, from where the nozzle …
                                           ///< … comes down on the pattern; absent: park_lift_mm
  int columns = 1;              ///< [1, 100] patterns side by side
  int rows = 1;                 ///< [1, 100] patterns one behind the other
  std::optional<int> patterns;  ///< [1, columns x rows] printed, from the first; absent: all
  /// Conditions of each pattern, instead of the fastest segments' speed and `acceleration_mm_s2`;
  /// empty: all are alike. As many as patterns.
  std::vector<PatternConditions> conditions;
  double pattern_gap_mm = 3;  ///< [0, 200] of free plate between two frames
};

/// Returns the pressure advance of each line of one pattern, in s, in print order. REQUIRES a valid
/// config.
[[nodiscard]] std::vector<double> PressureAdvances(const PatternConfig& config);

/// Returns the number of printed patterns.
[[nodiscard]] int PatternCount(const PatternConfig& config);

/// Returns the settings of one pattern's lines: those of its conditions.
[[nodiscard]] PatternConfig SettingsOf(const PatternConfig& config, int pattern);

/// Returns RepRapFirmware's extruder drive: the settings', else the number of the tool that the
/// start G-code selects, else 0.
[[nodiscard]] int DriveOf(const PatternConfig& config);

/// Returns the maximum of a line's speeds. REQUIRES segments.
[[nodiscard]] double FastSpeed_mm_s(const PatternConfig& config);

/// Returns mm of filament per mm of bead. REQUIRES a valid config.
[[nodiscard]] double FilamentPerMm(const PatternConfig& config);

/// Returns the first setting that cannot be printed, if any.
[[nodiscard]] std::optional<settings::SettingProblem> FindProblem(const PatternConfig& config);

/// Returns FindProblem as an error with the setting, the value and the bound.
[[nodiscard]] Result<void> Validate(const PatternConfig& config);

// Table of the settings that only this pattern has: [pressure_advance_pattern] of trammel.toml, and
// the keys in [printer] about its end.

using PatternField =
    settings::SettingField<PatternConfig, double, std::optional<double>, int, bool, std::string,
                           std::vector<double>, std::vector<Segment>, Finish>;

/// Returns all settings, in the order of `trammel config keys`; sections are contiguous.
[[nodiscard]] std::span<const PatternField> PatternFields();

/// Returns a choice as spelled in trammel.toml.
[[nodiscard]] std::string_view ToString(Finish finish);
[[nodiscard]] std::optional<Finish> ParseFinish(std::string_view name);

// Placeholders for a user's own start, end and idle G-code.

/// Returns every {name} with its value, units in the name.
[[nodiscard]] std::vector<gcode::Placeholder> PatternPlaceholders(const PatternConfig& config);

// Named patterns: several settings behind one key of trammel.toml.

/// Pattern with its scan settings.
enum class PatternPreset {
  kQuick,  ///< short lines, printed and swept to and fro without a stop: a third of the paper's
           ///< time
  kPaper,  ///< the published pattern and scan: what PatternConfig and ScanSettings default to
  kPhoto,  ///< 21 lines of the paper's, all one way, with a marked corner: for a phone's photo
};

/// Returns the segments of the preset photo, also used for a photo without a plan.
[[nodiscard]] std::vector<Segment> PhotoSegments();

inline constexpr PatternPreset kDefaultPreset = PatternPreset::kQuick;

/// Returns the spelling in trammel.toml.
[[nodiscard]] std::string_view ToString(PatternPreset preset);
[[nodiscard]] std::optional<PatternPreset> ParsePatternPreset(std::string_view name);

/// Sets the preset and its fields: every field that still has the earlier preset's value gets the
/// new one's, all others are unchanged. An empty PatternConfig::preset is the paper's.
void ApplyPreset(PatternPreset preset, PatternConfig& pattern, settings::ScanSettings& scan);
/// Does the same for the pattern only.
void ApplyPreset(PatternPreset preset, PatternConfig& pattern);

}  // namespace trammel::pressure_advance
