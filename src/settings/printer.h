// Printer and filament: [printer] and [filament] of trammel.toml, the same for every calibration
// that prints.
#pragma once

#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "gcode/dialect.h"
#include "settings/setting.h"

namespace trammel::settings {

enum class BedShape {
  kRectangle,
  kEllipse,  ///< inscribed in the rectangle of the bed's size: round beds, deltas
};

/// Returns the spelling in trammel.toml.
[[nodiscard]] std::string_view ToString(BedShape shape);
[[nodiscard]] std::optional<BedShape> ParseBedShape(std::string_view name);

/// "Paper": Abbott, Automatic Pressure Advance Calibration Using Laser Triangulation, and its
/// released code, whose values win where the two differ.
struct PrinterSettings {
  gcode::Dialect dialect = gcode::Dialect::kKlipper;  ///< the paper's firmware
  double bed_size_x_mm = 250;                         ///< (0, 2000]; the commonest CoreXY size
  double bed_size_y_mm = 250;
  double bed_origin_x_mm = 0;  ///< coordinates of the bed's front left corner; minus half the size
  double bed_origin_y_mm = 0;  ///< 0 if (0, 0) is the bed's centre
  BedShape bed_shape = BedShape::kRectangle;
  double bed_margin_mm = 5;         ///< [0, 100] kept free along the edge; clips and bevels
  double nozzle_diameter_mm = 0.4;  ///< [0.1, 2]; paper
  double travel_speed_mm_s = 150;   ///< (0, 1000]; no faster than the paper's lines
  double z_speed_mm_s = 5;          ///< (0, 100]; paper: F300
  double retract_length_mm = 0.5;   ///< [0, 20] of filament; paper (direct drive)
  double retract_speed_mm_s = 30;   ///< (0, 200]; paper: F1800
  double z_hop_mm = 0.75;           ///< [0, 10] above the layer while travelling; paper
  double z_offset_mm = 0;           ///< [-0.5, 2] added to the layer's height
  std::optional<double> park_x_mm;  ///< absent: the front left corner inside the margin …
  std::optional<double> park_y_mm;  ///< … or the middle of the front edge (ellipse; cutter there)
  double park_lift_mm = 20;         ///< [1, 200] above the layer when done; paper: Z20
  /// Heats and homes; leaves the filament primed. Default: Klipper's; WordsOf has the others'.
  std::string start_gcode{gcode::WordsOf(gcode::Dialect::kKlipper).start_gcode};
  std::string end_gcode{gcode::WordsOf(gcode::Dialect::kKlipper).end_gcode};
  std::optional<double> restore_acceleration_mm_s2;  ///< [1, 1e6]; absent: left as printed
};

/// Temperatures are never guessed: either the material is named or both temperatures are given
/// (settings/material.h).
struct FilamentSettings {
  std::string material;                             ///< one of Materials(); empty: none is named
  double filament_diameter_mm = 1.75;               ///< [1, 4]; paper
  std::optional<double> filament_density_g_cm3;     ///< [0.5, 10]; absent: the material's
  std::optional<double> nozzle_temperature_c;       ///< [170, 500]; absent: the material's
  std::optional<double> idle_nozzle_temperature_c;  ///< [0, 500]; absent: kIdleBelow_c lower
  std::optional<double> bed_temperature_c;          ///< [0, 200], 0: off; absent: the material's
};

using PrinterField = SettingField<PrinterSettings, double, std::optional<double>, std::string,
                                  gcode::Dialect, BedShape>;
using FilamentField = SettingField<FilamentSettings, double, std::optional<double>, std::string>;

/// Returns all settings, in the order of `trammel config keys`.
[[nodiscard]] std::span<const PrinterField> PrinterFields();
[[nodiscard]] std::span<const FilamentField> FilamentFields();

/// Computes a point's relative distance to the edge of the bed less a margin; 1 is its edge, the
/// limit.
[[nodiscard]] double BedReach(const PrinterSettings& printer, double x_mm, double y_mm,
                              double margin_mm);

/// Position of the nozzle after the print.
struct ParkPosition {
  double x_mm = 0;
  double y_mm = 0;
};
[[nodiscard]] ParkPosition ParkPositionOf(const PrinterSettings& printer);

/// Checks that the nozzle can wait at its park position. REQUIRES fields within their ranges.
[[nodiscard]] std::optional<SettingProblem> FindParkProblem(const PrinterSettings& printer);

/// Checks that the nozzle can lay such a bead, and does not scratch the plate. REQUIRES fields
/// within their ranges.
/// @param section  of layer_height and line_width.
[[nodiscard]] std::optional<SettingProblem> FindBeadProblem(const PrinterSettings& printer,
                                                            std::string_view section,
                                                            double layer_height_mm,
                                                            double line_width_mm);

/// Drawing of a calibration, as far as a user's own G-code may name it.
struct Drawing {
  double layer_height_mm = 0;
  double line_width_mm = 0;
  double acceleration_mm_s2 = 0;
  double min_x_mm = 0;  ///< outer edge of everything printed
  double min_y_mm = 0;
  double max_x_mm = 0;
  double max_y_mm = 0;
};

/// Returns every {name} that start and end G-code may use, with its value, units in the name.
[[nodiscard]] std::vector<gcode::Placeholder> Placeholders(const PrinterSettings& printer,
                                                           const FilamentSettings& filament,
                                                           const Drawing& drawing);

}  // namespace trammel::settings
