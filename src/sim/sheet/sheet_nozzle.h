// Where a nozzle is while its axes are sent somewhere: play, motor error, tool and coupling.
#pragma once

#include <array>
#include <vector>

#include "base/random.h"
#include "sim/sheet/sheet_gcode.h"
#include "sim/sheet/sheet_machine.h"

namespace trammel::sim {

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
