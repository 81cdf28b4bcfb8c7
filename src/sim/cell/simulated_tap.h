// One tap on its own: moves and samples as a client gets them, with the truth.
#pragma once

#include <optional>
#include <vector>

#include "base/random.h"
#include "sim/cell/load_cell.h"

namespace trammel::sim {

struct TapScene {
  TapMotion motion;
  double press_mm = 0.045;    ///< depth at the halt; 0: as the trigger and its latency bring it
  double surface_z_mm = 0;    ///< where the bed is
  double start_time_s = 100;  ///< of the approach
  double lead_s = 0.15;       ///< recorded before the nozzle meets the bed
  double tail_s = 0.32;       ///< and after the pull-back
};

struct SimulatedTap {
  std::vector<double> time_s;
  std::vector<double> force_g;
  std::vector<ZMove> moves;
  /// Absent where the pull-back is too short for the nozzle to let go.
  std::optional<PressTruth> truth;
  double latency_s = 0;  ///< of the converter
};

/// Taps once. REQUIRES valid traits and motion, press_mm >= 0.
[[nodiscard]] SimulatedTap SimulateTap(const CellTraits& traits, const TapScene& scene,
                                       Random& random);

}  // namespace trammel::sim
