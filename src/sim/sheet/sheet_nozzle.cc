#include "sim/sheet/sheet_nozzle.h"

#include <algorithm>
#include <cmath>
#include <numbers>

namespace trammel::sim {
namespace {

double ErrorAt(const PeriodicError& error, double place_mm) {
  return error.amplitude_mm *
         std::sin(2 * std::numbers::pi * place_mm / error.period_mm + error.phase_rad);
}

}  // namespace

SheetNozzle::SheetNozzle(const SheetMachine& machine, const Random& random)
    : machine_(machine), random_(random.Fork(1)) {
  Random first = random.Fork(0);
  for (double& lag_mm : x_lag_mm_) lag_mm = machine.backlash_mm[0] * first.Uniform(-0.5, 0.5);
  y_lag_mm_ = machine.backlash_mm[1] * first.Uniform(-0.5, 0.5);
}

double SheetNozzle::LagAt(double lag_mm, double travelled_mm, std::size_t axis) const {
  const double half_mm = machine_.backlash_mm[axis] / 2;
  return std::clamp(lag_mm - travelled_mm, -half_mm, half_mm);
}

const PlaneMm& SheetNozzle::CouplingOf(int pick_up) {
  while (couplings_.size() <= static_cast<std::size_t>(pick_up)) {
    const double x_mm = random_.Normal(0, machine_.coupling_mm);
    couplings_.push_back({x_mm, random_.Normal(0, machine_.coupling_mm)});
  }
  return couplings_[static_cast<std::size_t>(pick_up)];
}

PlaneMm SheetNozzle::At(const SheetMove& move, double fraction) {
  const double x_way_mm = fraction * (move.to.x_mm - move.from.x_mm);
  const double y_way_mm = fraction * (move.to.y_mm - move.from.y_mm);
  const double x_mm = move.from.x_mm + x_way_mm;
  const double y_mm = move.from.y_mm + y_way_mm;
  const PlaneMm& tool = machine_.tools[static_cast<std::size_t>(move.tool)].offset_mm;
  const PlaneMm& coupling = CouplingOf(move.pick_up);
  const auto drive = static_cast<std::size_t>(move.x_drive);
  return {x_mm + LagAt(x_lag_mm_[drive], x_way_mm, 0) + ErrorAt(machine_.motor[0], x_mm) +
              ErrorAt(machine_.pulley[0], x_mm) + tool.x_mm + coupling.x_mm,
          y_mm + LagAt(y_lag_mm_, y_way_mm, 1) + ErrorAt(machine_.motor[1], y_mm) +
              ErrorAt(machine_.pulley[1], y_mm) + tool.y_mm + coupling.y_mm};
}

void SheetNozzle::Finish(const SheetMove& move) {
  double& x_lag_mm = x_lag_mm_[static_cast<std::size_t>(move.x_drive)];
  x_lag_mm = LagAt(x_lag_mm, move.to.x_mm - move.from.x_mm, 0);
  y_lag_mm_ = LagAt(y_lag_mm_, move.to.y_mm - move.from.y_mm, 1);
}

}  // namespace trammel::sim
