#include "tool_offset/offset/sheet_model.h"

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>

#include "base/random.h"
#include "base/statistics.h"

namespace trammel::tool_offset {
namespace {

/// Bed axes; bias along the sheet's axes, for + legs and for - legs.
struct Truth {
  std::map<int, SheetPoint> tool_mm;
  SheetPoint backlash_mm;
  std::array<SheetPoint, 2> bias_mm;
};

double Dot(SheetPoint a, SheetPoint b) { return a.u_mm * b.u_mm + a.v_mm * b.v_mm; }

/// Readings that follow the equations, with noise of the size that they state.
std::vector<StructureReading> Readings(const SheetPlan& plan, const Truth& truth, double noise_mm,
                                       Random& random) {
  constexpr double kFreedom = 12;
  const double gain = std::sqrt(1.0 / plan.settings.teeth);
  const double t = plan.settings.tilt_deg * std::numbers::pi / 180;
  std::vector<StructureReading> readings;
  for (std::size_t i = 0; i < plan.structures.size(); ++i) {
    const Combination equation = StructureEquation(plan, plan.structures[i]);
    double value_mm = Dot(equation.backlash, truth.backlash_mm) +
                      Dot(equation.bias[0], truth.bias_mm[0]) +
                      Dot(equation.bias[1], truth.bias_mm[1]);
    for (const auto& [tool, weight] : equation.tool) {
      const SheetPoint& d = truth.tool_mm.at(tool);
      value_mm += Dot(weight, {d.u_mm * std::cos(t) + d.v_mm * std::sin(t),
                               -d.u_mm * std::sin(t) + d.v_mm * std::cos(t)});
    }
    if (noise_mm > 0) value_mm += random.Normal(0, noise_mm * gain * std::numbers::sqrt2);
    StructureReading reading;
    reading.structure = i;
    reading.gain = {gain, gain};
    reading.comb_freedom = {kFreedom, kFreedom};
    for (double& squares : reading.comb_squares_mm2) {
      for (int k = 0; k < static_cast<int>(kFreedom) && noise_mm > 0; ++k) {
        squares += std::pow(random.Normal(0, noise_mm), 2);
      }
    }
    reading.offset_mm = Measured::Good({value_mm, 1, {value_mm, value_mm}});
    readings.push_back(reading);
  }
  return readings;
}

SheetPlan Plan(double tilt_deg = 15) {
  SheetSettings settings;
  settings.tools = {0, 1, 2};
  settings.tilt_deg = tilt_deg;
  return PlanSheet(settings);
}

Combination DxOf(const SheetPlan& plan, int tool) {
  const double t = plan.settings.tilt_deg * std::numbers::pi / 180;
  Combination dx;
  dx.tool[tool] = {std::cos(t), -std::sin(t)};
  return dx;
}

TEST(SheetModel, FindsEveryUnknownWithEitherTilt) {
  constexpr double kExact_mm = 1e-9;
  for (const double tilt_deg : {15.0, -25.0}) {
    const SheetPlan plan = Plan(tilt_deg);
    Random random(1);
    const Truth truth{{{1, {0.3, -0.2}}, {2, {-0.1, 0.4}}},
                      {0.06, 0.04},
                      {SheetPoint{0.02, -0.01}, SheetPoint{0.02, -0.01}}};
    const SheetModel model(plan, Readings(plan, truth, 0, random));
    EXPECT_NEAR(model.Estimate(DxOf(plan, 1))->value, 0.3, kExact_mm);
    EXPECT_NEAR(model.Estimate(DxOf(plan, 2))->value, -0.1, kExact_mm);
    Combination backlash;
    backlash.backlash = {1, 0};
    EXPECT_NEAR(model.Estimate(backlash)->value, 0.06, kExact_mm);
    backlash.backlash = {0, 1};
    EXPECT_NEAR(model.Estimate(backlash)->value, 0.04, kExact_mm);
    EXPECT_FALSE(model.bias_by_direction());
  }
}

TEST(SheetModel, CoversTheTruthNineteenTimesInTwentyAtTheBestUncertainty) {
  constexpr int kRepeats = 500;
  constexpr double kNoise_mm = 0.004;
  const SheetPlan plan = Plan();
  const Truth truth{{{1, {0.3, -0.2}}, {2, {-0.1, 0.4}}}, {0.06, 0.04}, {}};
  Random random(2);
  std::vector<double> errors;
  int covered = 0;
  for (int i = 0; i < kRepeats; ++i) {
    const SheetModel model(plan, Readings(plan, truth, kNoise_mm, random));
    const Quantity dx = *model.Estimate(DxOf(plan, 1));
    errors.push_back(dx.value - 0.3);
    if (dx.interval95.lo <= 0.3 && 0.3 <= dx.interval95.hi) ++covered;
  }
  // The mean of the + and the - structure; the bias that they share does not count.
  const double best_mm = kNoise_mm * std::sqrt(2.0 / plan.settings.teeth) / std::numbers::sqrt2;
  EXPECT_NEAR(StandardDeviation(errors) / best_mm, 1, 0.095);  // 3 standard deviations
  EXPECT_NEAR(static_cast<double>(covered) / kRepeats, 0.95, 0.03);
}

TEST(SheetModel, AsksTheControlsWhetherTheBiasDependsOnTheDirection) {
  const SheetPlan plan = Plan();
  Random random(3);
  const Truth truth{{{1, {0.3, -0.2}}, {2, {-0.1, 0.4}}},
                    {0.06, 0.04},
                    {SheetPoint{0.03, 0.03}, SheetPoint{-0.03, -0.03}}};
  const SheetModel model(plan, Readings(plan, truth, 0.002, random));
  EXPECT_TRUE(model.bias_by_direction());
  const Quantity dx = *model.Estimate(DxOf(plan, 1));
  EXPECT_NEAR(dx.value, 0.3, 3 * dx.standard_uncertainty);
  EXPECT_LT(dx.standard_uncertainty, 0.002);
}

TEST(SheetModel, KnowsWhatTheReadableStructuresDoNotDetermine) {
  const SheetPlan plan = Plan();
  Random random(4);
  const Truth truth{{{1, {0.3, -0.2}}, {2, {-0.1, 0.4}}}, {}, {}};
  std::vector<StructureReading> readings = Readings(plan, truth, 0, random);
  for (StructureReading& reading : readings) {
    const Structure& structure = plan.structures[reading.structure];
    const bool of_tool_1 = structure.combs[0].tool == 1 || structure.combs[1].tool == 1;
    if (of_tool_1 && structure.axis == Axis::kY) reading.offset_mm = Measured::Refused("dirt");
  }
  const SheetModel model(plan, readings);
  EXPECT_FALSE(model.Estimate(DxOf(plan, 1)).has_value());
  EXPECT_TRUE(model.Estimate(DxOf(plan, 2)).has_value());
  const SheetModel nothing(plan, {});
  EXPECT_FALSE(nothing.Estimate(DxOf(plan, 1)).has_value());
}

}  // namespace
}  // namespace trammel::tool_offset
