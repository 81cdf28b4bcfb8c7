// Virtual machine that draws on paper: the true positions of its nozzles, and the appearance of its
// lines.
#pragma once

#include <array>
#include <vector>

#include "base/random.h"
#include "base/result.h"
#include "sim/sheet/sheet_gcode.h"

namespace trammel::sim {

using LinearRgb = std::array<double, 3>;  ///< reflectances, 0 black … 1 white, not gamma-coded

/// One nozzle. The defaults draw perfect lines.
struct SheetTool {
  /// Position of its lines minus that of the reference tool's, with the machine's state at
  /// power-on; +-25 mm.
  PlaneMm offset_mm;
  LinearRgb ink = {0.02, 0.02, 0.02};
  double width_factor = 1;  ///< of the width by the extruded volume, 0.3 … 3
  double opacity = 1;  ///< line opacity, 0.01 … 1: thin or translucent lines let paper through
  bool prints = true;  ///< false: nothing comes out
  double missing_share = 0;  ///< lines that do not stick at all, 0 … 1
  double broken_share = 0;   ///< legs with a gap or without adhesion, 0 … 1
  double string_share = 0;   ///< travels that begin with an ooze string, 0 … 1
};

/// Periodic error of one axis: of the motor's electrical cycle, or of its pulley.
struct PeriodicError {
  double amplitude_mm = 0;  ///< 0 … 0.2
  double period_mm = 1;     ///< 0.05 … 500
  double phase_rad = 0;
};

/// Traits of the machine that are constant between sheets. The defaults are ideal.
struct SheetMachine {
  std::array<SheetTool, kMaxSheetTools> tools;
  /// Backlash of x and y: the nozzle follows backlash/2 behind the commanded position, 0 … 1 mm.
  std::array<double, 2> backlash_mm = {0, 0};
  std::array<PeriodicError, 2> motor;   ///< x and y
  std::array<PeriodicError, 2> pulley;  ///< x and y
  double coupling_mm = 0;               ///< 1 sigma per axis of each pick-up of a tool, 0 … 0.5
  double leg_placement_mm = 0;          ///< 1 sigma per axis of each line, 0 … 0.1
  double leg_width_mm = 0;              ///< 1 sigma of each line's width, 0 … 0.1
  double edge_roughness_mm = 0;         ///< 1 sigma of each edge on its own, 0 … 0.1
  /// Correlation length of the roughness: exp(-distance / length), 0.05 … 2.
  double edge_correlation_mm = 0.25;
  double start_bulge_mm = 0;           ///< added to the width at a line's first end, -0.3 … 0.5
  double end_bulge_mm = 0;             ///< and at its last
  double bead_height_mm = 0.2;         ///< bead height under the nozzle, 0.05 … 1
  double filament_diameter_mm = 1.75;  ///< 0.5 … 5
};

/// Ink and paper of the print.
enum class SheetScene { kBlackOnWhite, kWhiteOnBlack, kColoursOnWhite };

/// "black-on-white", "white-on-black" or "colours-on-white". Error (kInput): another name.
[[nodiscard]] Result<SheetScene> ParseSheetScene(std::string_view name);

/// Draws a realistic machine: offsets within +-0.6 mm, backlash 0 … 80 um, line positions to 5 um
/// (1 sigma), edges rough by 20 um over 0.1 … 0.5 mm, widths to 10 um, motor error up to 3 um and
/// pulley error up to 10 um. All tools print; couplings are exact.
[[nodiscard]] SheetMachine DrawSheetMachine(SheetScene scene, Random& random);

/// Tracks the state of the backlash. The nozzle of an axis with backlash b remains in place until
/// the commanded position is b/2 away from it, and follows at that distance.
class SheetNozzle {
 public:
  /// The initial state of the backlash is random.
  SheetNozzle(const SheetMachine& machine, const Random& random);

  /// Returns the nozzle's position when `fraction` of a move is done. REQUIRES 0 <= fraction <= 1.
  [[nodiscard]] PlaneMm At(const SheetMove& move, double fraction);
  /// Ends the move: sets the backlash to its state at the end.
  void Finish(const SheetMove& move);

 private:
  [[nodiscard]] double LagAt(double lag_mm, double travelled_mm, std::size_t axis) const;
  [[nodiscard]] const PlaneMm& CouplingOf(int pick_up);

  const SheetMachine& machine_;
  Random random_;
  std::array<double, 2> x_lag_mm_{};  // nozzle minus command, per drive
  double y_lag_mm_ = 0;
  std::vector<PlaneMm> couplings_;  // per pick-up
};

}  // namespace trammel::sim
