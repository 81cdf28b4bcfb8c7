// How long a move takes.
#pragma once

namespace trammel::gcode {

/// Time of a trapezoid, or of a triangle where the cruising speed is not reached.
/// REQUIRES a length that allows the change of speed, acceleration > 0 and cruise > 0.
[[nodiscard]] double MoveTime_s(double length_mm, double enter_mm_s, double cruise_mm_s,
                                double leave_mm_s, double acceleration_mm_s2);

/// The same from rest to rest.
[[nodiscard]] double MoveTime_s(double length_mm, double cruise_mm_s, double acceleration_mm_s2);

}  // namespace trammel::gcode
