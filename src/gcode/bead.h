// How much filament a printed line takes.
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

}  // namespace trammel::gcode
