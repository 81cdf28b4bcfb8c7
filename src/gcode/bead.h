// Volume and time of an extruded move.
#pragma once

#include <numbers>

namespace trammel::gcode {

/// Fraction of its height that a bead's cross-section loses to its round sides: 1 - pi/4.
inline constexpr double kRoundSideLoss = 1 - std::numbers::pi / 4;

/// Returns the cross-section of a bead laid by a nozzle `height_mm` above the plate: a rectangle
/// with half circles as its sides, h (w - h (1 - pi/4)). REQUIRES 0 < height_mm <= width_mm.
[[nodiscard]] double BeadArea_mm2(double width_mm, double height_mm);

/// Returns mm of filament per mm of bead. REQUIRES as BeadArea_mm2, and a diameter above 0.
[[nodiscard]] double FilamentPerMm(double width_mm, double height_mm, double filament_diameter_mm);

/// Returns the time of a trapezoidal speed profile, triangular below the cruising speed.
/// REQUIRES a length that allows the change of speed, acceleration > 0 and cruise > 0.
[[nodiscard]] double MoveTime_s(double length_mm, double enter_mm_s, double cruise_mm_s,
                                double leave_mm_s, double acceleration_mm_s2);

/// Returns the same time from rest to rest.
[[nodiscard]] double MoveTime_s(double length_mm, double cruise_mm_s, double acceleration_mm_s2);

}  // namespace trammel::gcode
