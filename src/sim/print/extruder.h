// Filament that leaves the nozzle, from planned motion.
#pragma once

#include <cstddef>
#include <span>
#include <vector>

#include "sim/print/planner.h"
#include "sim/print/printer_traits.h"

namespace trammel::sim {

/// Integration step; also the grid of the smoothing kernel.
inline constexpr double kStepS = 0.25e-3;
/// Lead of the filament's clock over the motion's: smoothing looks ahead.
inline constexpr double kLeadS = 0.25;

/// Returns the filament pushed in each step, mm; element i covers the time from i * kStepS -
/// kLeadS. Klipper's rule: position + advance * velocity if a move deposits, position alone
/// otherwise, averaged with a triangular kernel of total width smooth_time. As in Klipper, an
/// advance of 0 also switches the averaging off. Sums to the commanded filament. REQUIRES smooth
/// times of at most 0.2 s.
[[nodiscard]] std::vector<double> DrivenFilament(std::span<const TimedMove> plan);

/// Unbroken stroke: consecutive moves that deposit.
struct Stroke {
  std::size_t first = 0;  ///< index into the plan
  std::size_t last = 0;   ///< inclusive
  double length_mm = 0;   ///< in x, y and z
  double arrives_s = 0;   ///< the nozzle stands at the stroke's start from here on
  double start_s = 0;
  double end_s = 0;
  double leaves_s = 0;  ///< the nozzle stands at the stroke's end until here
  bool primed = false;  ///< an un-retraction comes before it
};

[[nodiscard]] std::vector<Stroke> FindStrokes(std::span<const TimedMove> plan);

/// Properties of one stroke's extrusion, drawn from the traits.
struct StrokeFlow {
  StorageModel law;
  double factor = 1;         ///< delivered over commanded
  double start_loss_mm = 0;  ///< filament missing after an un-retraction
};

struct ExtruderOptions {
  Starvation starvation = Starvation::kRefill;
  double slip = 0;                    ///< share lost at slip_reference_mm_s
  double slip_reference_mm_s = 6.24;  ///< filament mm/s
  /// Slip while the nozzle stands, too: a fast un-retraction then loses up to half. Without it only
  /// the pressure of printing slips.
  bool slips_standing = true;
  double drift = 0;  ///< amplitude, share of the flow
  double drift_phase_rad = 0;
  double drift_period_s = 40;
};

/// Filament that left the nozzle along one stroke.
struct StrokeDeposit {
  double spacing_mm = 0;            ///< between nodes; the first and last node are the ends
  std::vector<double> filament_mm;  ///< per node: within half a spacing of it
};

struct Extrusion {
  std::vector<StrokeDeposit> strokes;
  double oozed_mm = 0;  ///< filament that left the nozzle away from every stroke
  double slipped_mm = 0;
  double stored_mm = 0;  ///< left in the hot end at the end
};

/// Pushes the driven filament through the hot end. Stored filament s follows ds = driven - out with
/// out = S^-1(s), solved with an exponential step (exact for the linear law). Filament is conserved
/// with Starvation::kRefill before `factor` and drift apply.
/// @param driven  from DrivenFilament of the same plan
/// @param flows   one per stroke
[[nodiscard]] Extrusion Extrude(std::span<const TimedMove> plan, std::span<const Stroke> strokes,
                                std::span<const double> driven, std::span<const StrokeFlow> flows,
                                const ExtruderOptions& options, double spacing_mm);

}  // namespace trammel::sim
