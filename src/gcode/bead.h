// Volume and time of an extruded move.
#pragma once

#include <numbers>

namespace trammel::gcode {

/// What of its height a bead's cross-section loses to its round sides: 1 - pi/4.
inline constexpr double kRoundSideLoss = 1 - std::numbers::pi / 4;

/// Cross-section of a bead laid by a nozzle `height_mm` above the plate: a rectangle with half
/// circles as its sides, h (w - h (1 - pi/4)). REQUIRES 0 < height_mm <= width_mm.
[[nodiscard]] double BeadArea_mm2(double width_mm, double height_mm);

/// mm of filament per mm of bead. REQUIRES what BeadArea_mm2 does, and a diameter above 0.
[[nodiscard]] double FilamentPerMm(double width_mm, double height_mm, double filament_diameter_mm);

/// Time of a trapezoid, or of a triangle where the cruising speed is not reached.
/// REQUIRES a length that allows the change of speed, acceleration > 0 and cruise > 0.
[[nodiscard]] double MoveTime_s(double length_mm, double enter_mm_s, double cruise_mm_s,
                                double leave_mm_s, double acceleration_mm_s2);

/// The same from rest to rest.
[[nodiscard]] double MoveTime_s(double length_mm, double cruise_mm_s, double acceleration_mm_s2);

}  // namespace trammel::gcode
