#include "sim/sheet/sheet_machine.h"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <string>

#include "sim/print/named_number.h"

namespace trammel::sim {

namespace {

constexpr NamedChoice<SheetScene> kScenes[] = {{"black-on-white", SheetScene::kBlackOnWhite},
                                               {"white-on-black", SheetScene::kWhiteOnBlack},
                                               {"colours-on-white", SheetScene::kColoursOnWhite}};

// Filaments that a flatbed distinguishes from white paper in at least one channel.
constexpr std::array<LinearRgb, kMaxSheetTools> kFilaments = {{{0.02, 0.02, 0.02},
                                                               {0.55, 0.03, 0.03},
                                                               {0.03, 0.08, 0.45},
                                                               {0.03, 0.30, 0.06},
                                                               {0.60, 0.16, 0.02},
                                                               {0.20, 0.03, 0.25},
                                                               {0.15, 0.15, 0.15},
                                                               {0.02, 0.30, 0.40}}};

LinearRgb InkOf(SheetScene scene, std::size_t tool, Random& random) {
  const double tone = random.Uniform(0.8, 1.2);
  LinearRgb ink = kFilaments[scene == SheetScene::kColoursOnWhite ? tool : 0];
  if (scene == SheetScene::kWhiteOnBlack) ink = {0.72, 0.72, 0.70};
  for (double& value : ink) value *= tone;
  return ink;
}

}  // namespace

Result<SheetScene> ParseSheetScene(std::string_view name) {
  return ChoiceOf(kScenes, "sheet scene", name);
}

SheetMachine DrawSheetMachine(SheetScene scene, Random& random) {
  constexpr double kTurn = 2 * std::numbers::pi;
  SheetMachine machine;
  for (std::size_t i = 0; i < machine.tools.size(); ++i) {
    SheetTool& tool = machine.tools[i];
    tool.offset_mm = {random.Uniform(-0.6, 0.6), random.Uniform(-0.6, 0.6)};
    if (i == 0) tool.offset_mm = {};
    tool.ink = InkOf(scene, i, random);
    tool.width_factor = random.Uniform(0.95, 1.05);
  }
  for (std::size_t axis = 0; axis < 2; ++axis) {
    machine.backlash_mm[axis] = random.Uniform(0, 0.080);
    // A 1.8 degree motor with a pulley of 20 teeth: four full steps are 0.8 mm, a turn is 40.
    machine.motor[axis] = {random.Uniform(0, 0.003), 0.8, random.Uniform(0, kTurn)};
    machine.pulley[axis] = {random.Uniform(0, 0.010), 40, random.Uniform(0, kTurn)};
  }
  machine.leg_placement_mm = 0.005;
  machine.leg_width_mm = 0.010;
  machine.edge_roughness_mm = 0.020;
  machine.edge_correlation_mm = random.Uniform(0.1, 0.5);
  machine.start_bulge_mm = random.Uniform(-0.05, 0.12);
  machine.end_bulge_mm = random.Uniform(-0.05, 0.12);
  return machine;
}

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
