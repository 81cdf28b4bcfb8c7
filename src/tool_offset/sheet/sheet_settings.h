// Settings of a printed sheet, and the table of their names, units and ranges.
#pragma once

#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "base/result.h"
#include "settings/printer.h"
#include "settings/setting.h"

namespace trammel::tool_offset {

/// Maximum bed temperature for paper: on a hotter bed it curls, and the tape comes off.
inline constexpr double kWarmestPaper_c = 60;

/// Settings of a sheet; SheetFields() has the ranges, FindProblem() the rules between fields.
struct SheetSettings {
  // Measured tools and structures.
  std::vector<int> tools = {0, 1};  ///< Numbers as the firmware has them, 2 … 8 (one: self-test).
  int reference_tool = 0;           ///< One of them; all offsets are against it.
  int controls = 2;                 ///< [2, 8] structures per axis, half of them each way.
  int pick_ups = 0;        ///< [0, 4] times that each tool is put back and picked up again.
  bool self_test = false;  ///< One tool, structures with programmed offsets.
  /// True: arranged for a camera (sheet_layout.h): larger, with the structures of a tool opposite
  /// each other.
  bool for_photo = false;

  // Combs.
  double pitch_mm = 4.19;        ///< [2, 10]; locks to no motor cycle (sheet_validate.h).
  int teeth = 17;                ///< [5, 60] per comb, at most: fewer where the paper asks for it.
  double leg_spacing_mm = 0.75;  ///< [0.3, 3] between the two legs of a finger.
  double leg_length_mm = 6;      ///< [3, 20]
  double overlap_mm = 4;         ///< [1, 19] along the legs, where both combs stand side by side.
  double structure_gap_mm = 3;   ///< [2, 20] between structures, and to the box.
  double tilt_deg = 15;          ///< [5, 40] or negative: both motors move along every leg.

  // Drawing.
  double line_width_mm = 0.4;        ///< [0.1, 1.5]
  double layer_height_mm = 0.2;      ///< [0.02, 1] above the paper
  double paper_thickness_mm = 0.1;   ///< [0, 1]; 80 g/m² office paper
  double print_speed_mm_s = 30;      ///< [1, 200]; the published sheet's
  double acceleration_mm_s2 = 2000;  ///< [100, 50000]
  double run_in_mm = 2;  ///< [1, 10] before each leg, the leg's own way: takes up the play

  // Tools, each list in the order of `tools`.
  std::vector<double> nozzle_temperatures_c;  ///< [150, 500]; empty: the filament's
  std::vector<double> retract_lengths_mm;     ///< [0, 20]; empty: the printer's
  std::vector<double> flows;                  ///< [0.5, 2], a factor; empty: 1
  double prime_length_mm = 2;                 ///< [0, 50] of filament before the prime line
  std::string tool_change_gcode = "T{tool}";  ///< picks up a tool, wherever the last one was
  std::string prime_gcode;                    ///< after a tool was picked up and is hot
  std::string wipe_gcode;                     ///< before a tool is put back

  // Position, and supply of the paper.
  std::string paper = "A4";             ///< paper in use (sheet_layout.h); "any": no bound
  std::optional<double> position_x_mm;  ///< box centre; absent: everything is centred on the bed
  std::optional<double> position_y_mm;
  std::string start_gcode = "G28\n";  ///< homes and levels before the paper comes
  double paper_clearance_mm = 50;     ///< [10, 300] of the nozzle above the bed meanwhile
  bool pause = true;                  ///< waits for the paper once everything is homed and cold
  std::string pause_gcode;            ///< empty: the dialect's own
  std::optional<double> bed_temperature_c;  ///< [0, 60]; absent: the filament's, at most 60

  settings::PrinterSettings printer;
  settings::FilamentSettings filament;
};

/// Minimum number of teeth to which a plan is reduced to fit: fewer measure too little.
inline constexpr int kFewestTeethToFit = 9;

/// Finds the first setting that cannot be printed, if any: the setting, its value, the bound, the
/// remedy.
[[nodiscard]] std::optional<settings::SettingProblem> FindProblem(const SheetSettings& settings);

/// Returns FindProblem as an error.
[[nodiscard]] Result<void> Validate(const SheetSettings& settings);

/// Warns of what can be printed but should not be. REQUIRES settings without a problem.
[[nodiscard]] std::vector<std::string> FindWarnings(const SheetSettings& settings);

inline constexpr std::string_view kSheetSection = "tool_offset_pattern";

using SheetField = settings::SettingField<SheetSettings, double, std::optional<double>, int, bool,
                                          std::string, std::vector<double>, std::vector<int>>;

/// Returns all settings but the printer's and the filament's, in the order of `trammel config
/// keys`.
[[nodiscard]] std::span<const SheetField> SheetFields();

}  // namespace trammel::tool_offset
