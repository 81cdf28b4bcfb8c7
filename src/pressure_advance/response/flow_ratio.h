// Estimates the flow ratio (extrusion multiplier) from a laser scan of the pattern.
#pragma once

#include <optional>
#include <vector>

#include "pressure_advance/profile/analysis.h"
#include "pressure_advance/profile/line_profile.h"

namespace trammel::pressure_advance {

/// Share of a bead's area that the laser reader reads, on one plate with one filament.
struct AreaReading {
  double share = 1;
  double sigma = 0;         ///< 1 sigma
  bool with_scale = false;  ///< the scale's error is part of the share, and not added again
};

/// Share on opaque plates, smooth or textured: of virtual beads, seeds 0 to 143, scanned with the
/// scale and angle of a set-up. A translucent plate scatters the laser's light and looks deeper
/// than it is: 0.97 to 1.2 there.
inline constexpr AreaReading kOpaqueReading{0.975, 0.016};

/// Returns the share that a reference shows: a scan of a pattern whose right flow ratio is known.
/// @param known_ratio  > 0
[[nodiscard]] AreaReading ReadingByReference(const AreaShare& reference, double known_ratio);

/// Measures the area of steady stretches over the commanded one, line by line, and combines the
/// lines by Tukey's biweight.
/// @returns no slow area with fewer than five lines with three readings in a steady stretch (those
/// of PlanTransitions). A line is broken where it has a reading below a third of the others' area.
[[nodiscard]] SteadyAreas MeasureSteadyAreas(const std::vector<LineProfile>& profiles,
                                             const LineMotion& motion, double commanded_area_mm2);

/// Facts of a scan that a flow ratio needs.
struct FlowPremises {
  std::optional<double> commanded_area_mm2;  ///< > 0
  std::optional<HeightScale> scale;
  bool opaque_plate = false;
};

/// Estimates commanded over laid area: the flow ratio to set where the pattern was printed with 1,
/// as trammel's is. The slow stretches count, as the extruder slips at speed.
///
/// Uncertainty: scatter of the lines; flow that wanders more slowly than a print; scale and laser
/// angle; what the reader sees of a bead. It holds for the filament that was printed: a diameter
/// that differs from the slicer's setting is part of the answer, and one that wanders by 0.02 mm of
/// 1.75 mm along the spool moves it by 2.3 %.
/// Cannot tell: scale unknown or an interval wider than +-0.05; commanded area unknown; too few
/// steady lines; areas that rise or fall over the pattern with the beads' heights (tilted bed).
[[nodiscard]] FlowRatio EstimateFlowRatio(const std::vector<LineProfile>& profiles,
                                          const LineMotion& motion, const FlowPremises& premises,
                                          const std::optional<AreaReading>& reference);

}  // namespace trammel::pressure_advance
