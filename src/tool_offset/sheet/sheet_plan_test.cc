#include "tool_offset/sheet/sheet_plan.h"

#include <gtest/gtest.h>

#include <cmath>
#include <map>
#include <numbers>
#include <set>

#include "tool_offset/sheet/sheet_plan_test_support.h"

namespace trammel::tool_offset {
namespace {

constexpr double kRounding_mm = 1e-9;

struct Point {
  double x_mm = 0;
  double y_mm = 0;
};

/// The sheet's point turned onto the bed, told anew here: counter-clockwise by the tilt.
Point OnBed(const SheetPoint& point, double tilt_deg) {
  const double t = tilt_deg * std::numbers::pi / 180;
  return {point.u_mm * std::cos(t) - point.v_mm * std::sin(t),
          point.u_mm * std::sin(t) + point.v_mm * std::cos(t)};
}

TEST(SheetPlan, EveryLegMovesTheBedAxisThatItMeasuresInTheCombsDirection) {
  for (const double tilt_deg : {15.0, -15.0, 5.0, 40.0}) {
    SheetSettings settings = WithTools(2);
    settings.tilt_deg = tilt_deg;
    const SheetPlan plan = PlanSheet(settings);
    for (const Structure& structure : plan.structures) {
      for (std::size_t comb = 0; comb < 2; ++comb) {
        for (const Leg& leg : FingerLegs(plan, structure, comb, 3)) {
          const Point start = OnBed(leg.start, tilt_deg);
          const Point end = OnBed(leg.end, tilt_deg);
          const double moved_mm =
              structure.axis == Axis::kX ? end.x_mm - start.x_mm : end.y_mm - start.y_mm;
          // sin 5° of 6 mm.
          EXPECT_GT(moved_mm * structure.combs[comb].direction, 0.5)
              << structure.name << " at " << tilt_deg;
        }
      }
    }
  }
}

/// Computes a leg's shift by backlash of 60 µm in x and 40 µm in y, along the axis it measures.
double ShiftByBacklash_mm(const Leg& leg, Axis axis, double tilt_deg) {
  const Point start = OnBed(leg.start, tilt_deg);
  const Point end = OnBed(leg.end, tilt_deg);
  const double x_mm = end.x_mm > start.x_mm ? -0.030 : 0.030;
  const double y_mm = end.y_mm > start.y_mm ? -0.020 : 0.020;
  const double t = tilt_deg * std::numbers::pi / 180;
  return axis == Axis::kX ? x_mm * std::cos(t) + y_mm * std::sin(t)
                          : -x_mm * std::sin(t) + y_mm * std::cos(t);
}

TEST(SheetPlan, PlayOf60And40MicronsMovesTheCombsBy23Point8AsTheFactsSay) {
  const SheetPlan plan = PlanSheet(WithTools(2));
  const Structure& x = Named(plan, "backlash X 1");
  const double low_mm = ShiftByBacklash_mm(FingerLegs(plan, x, 0, 0)[0], x.axis, 15);
  const double high_mm = ShiftByBacklash_mm(FingerLegs(plan, x, 1, 0)[0], x.axis, 15);
  EXPECT_NEAR(low_mm, -0.0238, 5e-6);
  EXPECT_NEAR(high_mm, 0.0238, 5e-6);
  // Equal directions: both combs move together and nothing is seen.
  const Structure& control = Named(plan, "control X+");
  EXPECT_EQ(ShiftByBacklash_mm(FingerLegs(plan, control, 0, 0)[0], x.axis, 15),
            ShiftByBacklash_mm(FingerLegs(plan, control, 1, 0)[0], x.axis, 15));
}

TEST(SheetPlan, SelfTestsMoveEachStructureByAnOffsetOfItsOwn) {
  SheetSettings settings;
  settings.tools = {0};
  settings.self_test = true;
  const SheetPlan plan = PlanSheet(settings);
  std::map<Axis, std::set<double>> offsets_mm;
  for (const Structure& structure : plan.structures) {
    if (structure.purpose != Purpose::kSelfTest) continue;
    const SheetPoint& low = structure.combs[0].programmed;
    const SheetPoint& high = structure.combs[1].programmed;
    const bool x = structure.axis == Axis::kX;
    const double moved_mm = x ? high.u_mm - low.u_mm : high.v_mm - low.v_mm;
    EXPECT_EQ(x ? high.v_mm - low.v_mm : high.u_mm - low.u_mm, 0);
    EXPECT_LE(std::abs(moved_mm), 0.5);
    EXPECT_NE(moved_mm, 0);
    EXPECT_TRUE(offsets_mm[structure.axis].insert(moved_mm).second) << structure.name;
    const std::size_t comb = structure.combs[0].direction > 0 ? 1 : 0;
    const Leg leg = FingerLegs(plan, structure, comb, 0)[0];
    const Comb& drawn = structure.combs[comb];
    EXPECT_NEAR((x ? leg.start.u_mm : leg.start.v_mm) + plan.settings.leg_spacing_mm / 2 -
                    FingerPosition_mm(plan, structure, comb, 0),
                x ? drawn.programmed.u_mm : drawn.programmed.v_mm, kRounding_mm);
  }
  EXPECT_EQ(offsets_mm[Axis::kX].size(), 8u);
  EXPECT_EQ(offsets_mm[Axis::kY].size(), 8u);
}

TEST(SheetPlan, TheNumberChangesWithAllThatIsMeasured) {
  std::set<std::uint32_t> ids{PlanSheet(SheetSettings{}).sheet_id};
  const auto expect_another = [&](const SheetSettings& settings, const char* what) {
    EXPECT_TRUE(ids.insert(PlanSheet(settings).sheet_id).second) << what;
  };
  SheetSettings settings;
  settings.pitch_mm = 3.71;
  expect_another(settings, "pitch");
  settings = {};
  settings.teeth = 16;
  expect_another(settings, "teeth");
  settings = {};
  settings.tilt_deg = -15;
  expect_another(settings, "tilt");
  settings = {};
  settings.tools = {0, 2};
  expect_another(settings, "tools");
  settings = {};
  settings.tools = {1, 0};
  settings.reference_tool = 1;
  expect_another(settings, "reference");
  settings = {};
  settings.overlap_mm = 3;
  expect_another(settings, "overlap");
  EXPECT_EQ(PlanSheet(SheetSettings{}).sheet_id, PlanSheet(SheetSettings{}).sheet_id);
}

}  // namespace
}  // namespace trammel::tool_offset
