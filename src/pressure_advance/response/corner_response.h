// Pressure advance from the surplus of filament at corners.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "pressure_advance/profile/analysis.h"

namespace trammel::pressure_advance {

/// Reading of one candidate's corner.
struct CornerSurplus {
  double pressure_advance_s = 0;
  double surplus_mm = 0;  ///< length of band in surplus around the corner; negative: missing
  double sigma_mm = 0;    ///< 1 sigma of the reading's noise, > 0
  double wider = 0;       ///< width of one arm over the other's, less 1; a shadow's where not 0
  std::string unusable;   ///< why this corner must not be used; empty if usable
};

/// Motion through the corners, as far as known.
struct CornerMotion {
  std::optional<double> speed_mm_s;
  std::optional<double> acceleration_mm_s2;
  double smooth_time_s = 0.04;  ///< of Klipper's pressure advance, its default; 0: none
};

/// Distance from the corner, along the path, within which filament is counted. Farther off, shadows
/// and arms that are not quite straight weigh more than filament; nearer, filament lies outside. Of
/// 47 virtual photos (seeds 360000 to 360023 of both tools) the answers scattered by 2.5 ms at
/// 0.8 mm, 1.9 to 2.2 ms at 1 to 1.7 mm.
inline constexpr double kCornerWindow_mm = 1.2;

/// Fits the surplus over pressure advance (signal::FitZeroCrossing): filament is conserved, so that
/// it falls through zero at the right value.
///
/// Around a corner the nozzle brakes and accelerates again; the answer is that of this short dip in
/// the flow. Where the lag thins with flow it is below the answer of long lines.
/// @returns an analysis with lines, `corners` and the answer: cannot-tell where the corners do not
///   respond, the value may be outside the tested range, or its interval is too wide; refused with
///   fewer than 6 usable corners.
[[nodiscard]] Analysis FitCorners(const std::vector<CornerSurplus>& corners,
                                  const CornerMotion& motion);

}  // namespace trammel::pressure_advance
