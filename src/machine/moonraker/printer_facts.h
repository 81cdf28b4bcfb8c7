// What a printer's own configuration states of itself, as far as a print may contradict it.
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

/// A second carriage on an axis. Named ones are generic_cartesian's: SET_DUAL_CARRIAGE takes their
/// names, where others are 0 and 1.
struct DualCarriage {
  std::string primary;  ///< empty: the axis' own
  std::string name;     ///< empty: [dual_carriage] without a name
};

/// The shape in x and y that the nozzle reaches between axis_minimum and axis_maximum.
enum class ReachShape { kUnknown, kRectangle, kEllipse };

/// The places that the nozzle reaches, in G-code's coordinates.
struct Reach {
  std::array<double, 3> minimum_mm{};
  std::array<double, 3> maximum_mm{};
  bool round = false;                 ///< an ellipse inscribed in x and y, as of deltas
  std::array<double, 3> offset_mm{};  ///< SET_GCODE_OFFSET's, already taken off the two

  [[nodiscard]] bool Contains(double x_mm, double y_mm) const;
  /// All corners of bounds in x and y.
  template <class Bounds>
  [[nodiscard]] bool Contains(const Bounds& bounds) const {
    return Contains(bounds.min_x_mm, bounds.min_y_mm) &&
           Contains(bounds.min_x_mm, bounds.max_y_mm) &&
           Contains(bounds.max_x_mm, bounds.min_y_mm) && Contains(bounds.max_x_mm, bounds.max_y_mm);
  }
  /// "X 0.0 ... 250.0, Y 0.0 ... 250.0 mm", with " in a circle" where it is round, and the offset.
  [[nodiscard]] std::string Describe() const;
};

/// Of one extruder and of the motion. What is absent the printer does not state.
struct PrinterFacts {
  std::string kinematics;  ///< as [printer] names them; empty: not stated
  Reach reach;             ///< round where no kinematics is known to reach more

  double max_velocity_mm_s = 0;  ///< in force; 0: not stated
  double max_accel_mm_s2 = 0;
  double configured_max_velocity_mm_s = 0;  ///< of printer.cfg; 0: not stated
  double configured_max_accel_mm_s2 = 0;

  std::string extruder;         ///< its section: the active one, or the one that was asked for
  bool configured = false;      ///< the configuration has that section
  bool one_of_several = false;  ///< which of several is active the printer does not state
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
  std::optional<double> max_angular_velocity_rad_s;  ///< of a polar printer; absent: any
  bool no_bed_heater = false;  ///< the configuration has the extruder's section, no [heater_bed]

  /// Kalico's model other than the linear one: "tanh", "recipr". Empty: linear.
  std::string pressure_advance_model;
  /// The printer has the extruder, and reports no pressure advance of it.
  bool no_pressure_advance = false;
  /// Whose filament the extruder's own motor pushes, where that is another's; else empty.
  std::string pushes_for = {};
  /// Of the motors that push the extruder's filament, by their sections, the extruder's own first:
  /// "extruder", "extruder_stepper belted".
  std::vector<std::string> advance_motors;
  /// Of these motors, those that report over which time Klipper smooths their pressure advance, s.
  std::map<std::string, double> smooth_times_s;

  std::vector<DualCarriage> dual_carriages;
  std::set<std::string> sections;  ///< of printer.cfg, in lower case

  /// Of known kinematics; kUnknown where they are not stated, too.
  [[nodiscard]] ReachShape shape() const;
  /// What SET_PRESSURE_ADVANCE needs as EXTRUDER= to reach all motors; empty: it reaches them
  /// without.
  [[nodiscard]] std::vector<std::string> advance_names() const;
};

/// Reads the facts. Values of a wrong type or beyond any printer's count as not stated; of more
/// sections than any printer has the rest is left out.
/// @param status  an answer with configfile's settings
/// @param extruder  whose facts; empty: the active one's
[[nodiscard]] PrinterFacts FactsOf(const nlohmann::json& status, const PrinterState& state,
                                   const std::string& extruder = {});

}  // namespace trammel::machine
