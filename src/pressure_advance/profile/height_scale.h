// What a laser's pixels are in millimetres, and how well that is known.
#pragma once

#include <optional>

namespace trammel::pressure_advance {

/// Standard uncertainty of what the eye itself makes of a height and of an area, as a share of it:
/// it reads virtual beads too low, by filament and plate, as light enters the filament and the
/// bead's foot is lost in the plate's. It is not taken off: real filament may do otherwise.
inline constexpr double kHeightReadingShare = 0.13;
inline constexpr double kAreaReadingShare = 0.16;

/// By scale and laser angle, which are common to all heights and areas of a scan: what is said of
/// how lines differ does not depend on them.
struct HeightScale {
  double px_per_mm = 0;         ///< on the plate, > 0
  double height_mm_per_px = 0;  ///< of the laser line's shift, > 0
  /// Standard uncertainty that both leave a height and an area, as a share of it; absent where
  /// either is not known.
  std::optional<double> height_share;
  std::optional<double> area_share;
};

}  // namespace trammel::pressure_advance
