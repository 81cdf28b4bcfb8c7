// Model of Klipper printing a file, written from its sources and sharing no code with trammel:
// limits of motion, filament and heat, junctions, and the motors that receive a pressure advance.
#pragma once

#include <array>
#include <map>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

namespace trammel::test {

/// An [extruder] section, with Klipper's defaults.
struct ModelExtruder {
  double nozzle_diameter_mm = 0.4;
  double filament_diameter_mm = 1.75;
  double min_temp_c = 0;
  double max_temp_c = 280;
  double min_extrude_temp_c = 170;
  std::optional<double> max_extrude_cross_section_mm2;  ///< absent: 4 nozzle_diameter^2
  double max_extrude_only_distance_mm = 50;
  std::optional<double> max_extrude_only_velocity_mm_s;  ///< absent: by max_velocity
  std::optional<double> max_extrude_only_accel_mm_s2;    ///< absent: by max_accel
  double instantaneous_corner_velocity_mm_s = 1;
  std::string pressure_advance_model = {};  ///< Kalico's; empty: the linear one
};

/// A motor that pushes filament: an extruder's own or an [extruder_stepper].
struct ModelMotor {
  std::string queue;  ///< the extruder whose filament it pushes; empty: none's
  double smooth_time_s = 0.04;
  double pressure_advance_s = 0.03;
  bool synchronised = true;  ///< false: an own motor whose queue Klipper reports as null
};

/// A printer as it is.
struct ModelPrinter {
  std::string name = "corexy";
  std::string kinematics = "corexy";
  std::array<double, 3> minimum_mm{0, 0, -5};
  std::array<double, 3> maximum_mm{250, 250, 240};
  double max_velocity_mm_s = 300;  ///< current limit
  double max_accel_mm_s2 = 5000;
  double configured_max_velocity_mm_s = 300;
  double configured_max_accel_mm_s2 = 5000;
  double minimum_cruise_ratio = 0.5;
  double square_corner_velocity_mm_s = 5;
  bool before_2024 = false;  ///< max_accel_to_decel instead of the ratio
  double max_z_velocity_mm_s = 15;
  std::optional<double> max_angular_velocity_rad_s;  ///< polar printers only
  std::map<std::string, ModelExtruder> extruders{{"extruder", {}}};
  std::map<std::string, ModelMotor> motors{{"extruder", {"extruder"}}};
  std::string active = "extruder";
  std::optional<double> bed_max_temp_c = 120;  ///< absent: no [heater_bed]
  std::vector<std::string> other_sections;
  // The G-code interpreter.
  bool absolute_coordinates = true;
  bool absolute_extrude = true;
  double speed_factor = 1;
  double extrude_factor = 1;
  std::array<double, 3> origin_mm{};  ///< SET_GCODE_OFFSET
};

/// A stretch of a printed line: one move, or a part of it.
struct ModelPiece {
  double length_mm = 0;
  double start_mm_s = 0, cruise_mm_s = 0, end_mm_s = 0;
  double accel_mm_s2 = 0;
};

struct ModelLine {
  std::vector<ModelPiece> pieces;
  double filament_mm = 0;
  std::map<std::string, double> pressure_advance_s;  ///< per motor, during this line

  [[nodiscard]] double Length_mm() const;
  /// Speed of the nozzle at a place along the line.
  [[nodiscard]] double SpeedAt_mm_s(double at_mm) const;
};

struct ModelPrint {
  std::string refusal;  ///< error with which Klipper ends the print; empty: none
  std::vector<ModelLine> lines;
  double longest_filament_move_s = 0;  ///< the longest time that filament moves without the head
};

/// Runs a file of trammel on a printer. Lines are told by the file's "; line N of pattern M".
[[nodiscard]] ModelPrint PrintOn(const ModelPrinter& printer, std::string_view gcode);

}  // namespace trammel::test
