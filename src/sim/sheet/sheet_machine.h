// The virtual machine that draws on paper: where its nozzles really are, and how its lines look.
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
  /// Where its line lands minus where the reference tool's line lands, as the machine stands when
  /// switched on; +-25 mm.
  PlaneMm offset_mm;
  LinearRgb ink = {0.02, 0.02, 0.02};
  double width_factor = 1;  ///< of the width that the extruded volume gives, 0.3 … 3
  double opacity = 1;  ///< of its lines, 0.01 … 1: thin or translucent ones let paper through
  bool prints = true;  ///< false: nothing comes out
  double missing_share = 0;  ///< of its lines that do not stick at all, 0 … 1
  double broken_share = 0;   ///< of its legs that have a gap or do not stick, 0 … 1
  double string_share = 0;   ///< of its travels that begin with an ooze string, 0 … 1
};

/// A periodic error of one axis: of the motor's electrical cycle, or of its pulley.
struct PeriodicError {
  double amplitude_mm = 0;  ///< 0 … 0.2
  double period_mm = 1;     ///< 0.05 … 500
  double phase_rad = 0;
};

/// Everything of the machine that does not change from sheet to sheet. The defaults are ideal.
struct SheetMachine {
  std::array<SheetTool, kMostSheetTools> tools;
  /// Play of x and y: the nozzle follows play/2 behind the commanded place, 0 … 1 mm.
  std::array<double, 2> backlash_mm = {0, 0};
  std::array<PeriodicError, 2> motor;   ///< x and y
  std::array<PeriodicError, 2> pulley;  ///< x and y
  double coupling_mm = 0;               ///< 1 sigma per axis of each pick-up of a tool, 0 … 0.5
  double leg_placement_mm = 0;          ///< 1 sigma per axis of each line, 0 … 0.1
  double leg_width_mm = 0;              ///< 1 sigma of each line's width, 0 … 0.1
  double edge_roughness_mm = 0;         ///< 1 sigma of each edge on its own, 0 … 0.1
  /// Of the roughness: exp(-distance / length), 0.05 … 2.
  double edge_correlation_mm = 0.25;
  double start_bulge_mm = 0;           ///< added to the width at a line's first end, -0.3 … 0.5
  double end_bulge_mm = 0;             ///< and at its last
  double bead_height_mm = 0.2;         ///< that the nozzle presses a line to, 0.05 … 1
  double filament_diameter_mm = 1.75;  ///< 0.5 … 5
};

/// What was printed on what.
enum class SheetScene { kBlackOnWhite, kWhiteOnBlack, kColoursOnWhite };

/// "black-on-white", "white-on-black" or "colours-on-white". Error (kInput): another name.
[[nodiscard]] Result<SheetScene> ParseSheetScene(std::string_view name);

/// One machine among those that people have: offsets within +-0.6 mm, play 0 … 80 um, lines placed
/// to 5 um (1 sigma), edges rough by 20 um over 0.1 … 0.5 mm, widths to 10 um, motor error up to
/// 3 um and pulley error up to 10 um. All tools print; couplings are exact.
[[nodiscard]] SheetMachine DrawSheetMachine(SheetScene scene, Random& random);

/// Keeps the state of the play. The nozzle of an axis with play b stays where it is until the
/// commanded place is b/2 away from it, and follows at that distance.
class SheetNozzle {
 public:
  /// The play stands anywhere at first.
  SheetNozzle(const SheetMachine& machine, const Random& random);

  /// Where the nozzle is when `fraction` of a move is done. REQUIRES 0 <= fraction <= 1.
  [[nodiscard]] PlaneMm At(const SheetMove& move, double fraction);
  /// Ends the move: the play now stands as at its end.
  void Finish(const SheetMove& move);

 private:
  [[nodiscard]] double LagAt(double lag_mm, double travelled_mm, std::size_t axis) const;
  [[nodiscard]] const PlaneMm& CouplingOf(int pick_up);

  const SheetMachine& machine_;
  Random random_;
  std::array<double, 2> x_lag_mm_{};  // nozzle minus command, per drive
  double y_lag_mm_ = 0;
  std::vector<PlaneMm> couplings_;  // by pick-up
};

}  // namespace trammel::sim
