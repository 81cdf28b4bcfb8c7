// What a virtual printer left on its bed. The renderers see this and nothing else of the print.
#pragma once

#include <vector>

namespace trammel::sim {

/// The cross-section of a bead where the nozzle passed one point.
struct BeadSample {
  double x_mm = 0;  ///< on the bed
  double y_mm = 0;
  double area_mm2 = 0;   ///< 0 where the filament broke
  double width_mm = 0;   ///< at the plate; 0 where it broke
  double height_mm = 0;  ///< of its top above the plate
};

/// One unbroken movement of the nozzle with filament: samples in print order, at most 0.05 mm
/// apart.
struct Strand {
  std::vector<BeadSample> samples;
};

struct Bed {
  double size_x_mm = 0;
  double size_y_mm = 0;
  std::vector<Strand> strands;
};

/// The truth of one virtual print, kept beside its recordings and never read by the analysis.
struct PrintTruth {
  double pressure_advance_s = 0;  ///< K*: the PA that stores just what the speed change needs
};

}  // namespace trammel::sim
