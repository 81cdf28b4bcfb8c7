// Facts from a printer's own configuration, as far as a print may contradict them.
#pragma once

#include <array>
#include <map>
#include <nlohmann/json_fwd.hpp>
#include <optional>
#include <set>
#include <string>
#include <vector>

#include "machine/moonraker/printer.h"

namespace trammel::machine {

/// Second carriage on an axis. Names are those of generic_cartesian: SET_DUAL_CARRIAGE takes them,
/// where other kinematics use 0 and 1.
struct DualCarriage {
  std::string primary;  ///< empty: the axis' own
  std::string name;     ///< empty: [dual_carriage] without a name
};

/// Shape of the nozzle's reach in x and y between axis_minimum and axis_maximum.
enum class ReachShape { kUnknown, kRectangle, kEllipse };

/// Positions that the nozzle reaches, in G-code coordinates.
struct Reach {
  std::array<double, 3> minimum_mm{};
  std::array<double, 3> maximum_mm{};
  bool round = false;                 ///< an ellipse inscribed in x and y, as of deltas
  std::array<double, 3> offset_mm{};  ///< SET_GCODE_OFFSET's, already taken off the two

  [[nodiscard]] bool Contains(double x_mm, double y_mm) const;
  /// True if all corners of the bounds are reachable in x and y.
  template <class Bounds>
  [[nodiscard]] bool Contains(const Bounds& bounds) const {
    return Contains(bounds.min_x_mm, bounds.min_y_mm) &&
           Contains(bounds.min_x_mm, bounds.max_y_mm) &&
           Contains(bounds.max_x_mm, bounds.min_y_mm) && Contains(bounds.max_x_mm, bounds.max_y_mm);
  }
  /// "X 0.0 ... 250.0, Y 0.0 ... 250.0 mm", with " in a circle" where it is round, and the offset.
  [[nodiscard]] std::string Describe() const;
};

/// Facts on one extruder and the motion, as reported by the printer; absent: not reported.
struct PrinterFacts {
  std::string kinematics;  ///< as in [printer]; empty: not stated
  Reach reach;             ///< round where no kinematics is known to reach more

  double max_velocity_mm_s = 0;  ///< current limit; 0: not stated
  double max_accel_mm_s2 = 0;
  double configured_max_velocity_mm_s = 0;  ///< from printer.cfg; 0: not stated
  double configured_max_accel_mm_s2 = 0;

  std::string extruder;         ///< section of the active or requested extruder
  bool configured = false;      ///< the configuration has that section
  bool one_of_several = false;  ///< true if the active one of several is unknown
  std::string unreadable = {};  ///< a diameter in it that is no size; empty: none
  std::optional<double> nozzle_diameter_mm;
  std::optional<double> filament_diameter_mm;
  std::optional<double> min_extrude_temp_c;
  std::optional<double> nozzle_max_c;
  std::optional<double> bed_max_c;
  std::optional<double> max_extrude_cross_section_mm2;
  std::optional<double> max_extrude_only_distance_mm;
  std::optional<double> max_extrude_only_velocity_mm_s;
  std::optional<double> max_extrude_only_accel_mm_s2;
  std::optional<double> instantaneous_corner_velocity_mm_s;
  std::optional<double> max_angular_velocity_rad_s;  ///< polar printers only; absent: no limit
  bool no_bed_heater = false;  ///< the configuration has the extruder's section, no [heater_bed]

  /// Kalico's nonlinear model: "tanh", "recipr". Empty: linear.
  std::string pressure_advance_model;
  /// True if the printer has the extruder, but reports no pressure advance of it.
  bool no_pressure_advance = false;
  /// Extruder whose filament this one's motor pushes, if another's; else empty.
  std::string pushes_for = {};
  /// Sections of the motors that push the extruder's filament, the extruder's own first:
  /// "extruder", "extruder_stepper belted".
  std::vector<std::string> advance_motors;
  /// Time over which Klipper smooths pressure advance, s, of those of these motors that report it.
  std::map<std::string, double> smooth_times_s;

  std::vector<DualCarriage> dual_carriages;
  std::set<std::string> sections;  ///< of printer.cfg, lower case

  /// Returns the shape of known kinematics; kUnknown if not reported, too.
  [[nodiscard]] ReachShape shape() const;
  /// Returns the values of EXTRUDER= with which SET_PRESSURE_ADVANCE reaches all motors; empty: it
  /// needs none.
  [[nodiscard]] std::vector<std::string> advance_names() const;
};

/// Reads the facts. Values of a wrong type or beyond any printer's count as not stated; sections
/// beyond any printer's number are ignored.
/// @param status  an answer with configfile's settings
/// @param extruder  whose facts; empty: the active one's
[[nodiscard]] PrinterFacts FactsOf(const nlohmann::json& status, const PrinterState& state,
                                   const std::string& extruder = {});

}  // namespace trammel::machine
