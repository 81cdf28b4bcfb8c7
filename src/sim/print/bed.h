// Print on the bed of a virtual printer. The renderers see this and nothing else of the print.
#pragma once

#include <optional>
#include <vector>

namespace trammel::sim {

/// Cross-section of a bead at one point of the nozzle's path.
struct BeadSample {
  double x_mm = 0;  ///< on the bed
  double y_mm = 0;
  double area_mm2 = 0;   ///< 0 where the filament broke
  double width_mm = 0;   ///< at the plate; 0: broken
  double height_mm = 0;  ///< top above what it rests on
  double base_mm = 0;    ///< what it rests on, above the plate: 0, or the layer below
};

/// Continuous movement of the nozzle with filament: samples in print order, at most 0.05 mm apart.
struct Strand {
  std::vector<BeadSample> samples;
};

struct Bed {
  double size_x_mm = 0;
  double size_y_mm = 0;
  std::vector<Strand> strands;
};

/// Truth of the corners that one speed and acceleration have in common: one chevron pattern.
struct CornerTruth {
  double speed_mm_s = 0;
  double acceleration_mm_s2 = 0;
  double pressure_advance_s = 0;  ///< secant of the storage law from standstill to the arms' flow
  double tangent_s = 0;           ///< slope of the law at the arms' flow
  double corner_s = 0;            ///< print/corner_truth.h
  double x_mm = 0;                ///< mean place of the corners
  double y_mm = 0;
};

/// Truth of one virtual print, stored beside its recordings and never read by the analysis.
struct PrintTruth {
  /// K*: the PA that stores just what the change of flow needs: the secant of the storage law
  /// between the slow and the fast flow.
  double pressure_advance_s = 0;
  /// Slope of the storage law at the fast flow: what a short dip from that flow needs. Equal to K*
  /// where the lag is linear, below it where the lag thins.
  double tangent_s = 0;
  /// Prints with sharp corners: the pressure advance that lays the commanded filament around them
  /// (print/corner_truth.h).
  std::optional<double> corner_s = std::nullopt;
  /// The same for each speed and acceleration at which the highest layer has corners, in print
  /// order.
  std::vector<CornerTruth> corners = {};
  double flow_factor = 1;  ///< delivered over commanded flow; scatter, drift, slip apart
};

}  // namespace trammel::sim
