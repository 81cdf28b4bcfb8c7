#include "pressure_advance/flow/flow_table.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <functional>
#include <limits>
#include <vector>

#include "base/check.h"
#include "base/random.h"

namespace trammel::pressure_advance {
namespace {

using ::testing::HasSubstr;
using ::testing::IsEmpty;
using ::testing::SizeIs;

FlowPoint Point(double flow_mm3_s, double acceleration_mm_s2, double value_s, double u_s = 0.001) {
  FlowPoint point;
  point.flow_mm3_s = flow_mm3_s;
  point.slow_flow_mm3_s = 0.5;
  point.acceleration_mm_s2 = acceleration_mm_s2;
  point.pressure_advance_s = {value_s, u_s, {value_s - 1.96 * u_s, value_s + 1.96 * u_s}};
  return point;
}

TEST(FlowTable, OrdersRowsAndCombinesThoseUnderTheSameConditions) {
  const auto table = MakeFlowTable({Point(10, 4000, 0.030), Point(5, 2000, 0.050, 0.001),
                                    Point(5.05, 2010, 0.052, 0.001), Point(10, 2000, 0.044)});
  ASSERT_TRUE(table) << table.error().message;
  ASSERT_THAT(table->rows, SizeIs(3));
  EXPECT_EQ(table->rows[0].count, 2);
  EXPECT_NEAR(table->rows[0].pressure_advance_s.value, 0.051, 1e-12);
  EXPECT_EQ(table->rows[1].flow_mm3_s, 10);
  EXPECT_EQ(table->rows[2].acceleration_mm_s2, 4000);
  EXPECT_NEAR(table->single_s.value, (0.051 + 0.044 + 0.030) / 3, 1e-12);
  EXPECT_NEAR(table->greatest_miss_s, (0.051 + 0.044 + 0.030) / 3 - 0.030, 1e-12);
}

// Two calibrations that contradict each other are worth less than either.
TEST(FlowTable, WidensWhatScattersMoreThanItStates) {
  const auto table = MakeFlowTable({Point(5, 2000, 0.040, 0.001), Point(5, 2000, 0.050, 0.001)});
  ASSERT_TRUE(table);
  EXPECT_GT(table->rows[0].pressure_advance_s.standard_uncertainty, 0.004);
  EXPECT_LT(table->rows[0].pressure_advance_s.interval95.lo, 0.0);
}

TEST(FlowTable, SaysHowTheValueChangesAndWhetherItDoes) {
  // 0.06 s less 1 ms for each mm³/s, less 5 ms for each doubling of the acceleration.
  std::vector<FlowPoint> points;
  for (const double flow : {4.0, 8.0, 16.0}) {
    for (const double doubling : {0.0, 1.0, 2.0}) {
      points.push_back(
          Point(flow, 1000 * std::exp2(doubling), 0.06 - 0.001 * flow - 0.005 * doubling, 0.0005));
    }
  }
  const auto table = MakeFlowTable(points);
  ASSERT_TRUE(table);
  ASSERT_TRUE(table->over_flow.per_unit.good());
  EXPECT_NEAR(table->over_flow.per_unit.quantity().value, -0.001, 1e-12);
  EXPECT_TRUE(table->over_flow.significant);
  ASSERT_TRUE(table->over_acceleration.per_unit.good());
  EXPECT_NEAR(table->over_acceleration.per_unit.quantity().value, -0.005, 1e-12);
  EXPECT_TRUE(table->over_acceleration.significant);
  EXPECT_THAT(AdaptiveRows(*table), SizeIs(9));
}

// Filaments independent of flow are reported as dependent in 5 % by design; dependent ones nearly
// always.
TEST(FlowTable, TrendsAreSeenWhereTheyAreThereAndRarelyWhereNot) {
  constexpr int kWorlds = 2000;
  for (const double slope : {0.0, -0.0006}) {
    int seen = 0;
    for (int world = 0; world < kWorlds; ++world) {
      Random random(9000 + static_cast<std::uint64_t>(world));
      std::vector<FlowPoint> points;
      for (const double flow : {4.0, 8.0, 16.0}) {
        for (const double acceleration : {1000.0, 3000.0}) {
          points.push_back(
              Point(flow, acceleration, 0.05 + slope * flow + 0.001 * random.Normal()));
        }
      }
      const auto table = MakeFlowTable(points);
      ASSERT_TRUE(table);
      seen += table->over_flow.significant ? 1 : 0;
    }
    const double share = static_cast<double>(seen) / kWorlds;
    if (slope == 0) {
      EXPECT_LT(share, 0.065);
    } else {
      EXPECT_GT(share, 0.95);
    }
  }
}

FlowPoint InLayers(double layer_height_mm, FlowPoint point) {
  point.layer_height_mm = layer_height_mm;
  return point;
}

// The lower layer needs 20 ms more at each flow: mixed, that would look like a change over flow.
TEST(FlowTable, ComparesNoRowsOfDifferentLayerHeights) {
  const auto table =
      MakeFlowTable({InLayers(0.3, Point(9, 3000, 0.040)), InLayers(0.2, Point(6, 3000, 0.060)),
                     InLayers(0.3, Point(12, 3000, 0.040)), InLayers(0.2, Point(9, 3000, 0.060)),
                     InLayers(0.201, Point(9, 3000, 0.060))});
  ASSERT_TRUE(table) << table.error().message;
  ASSERT_THAT(table->rows, SizeIs(4));
  EXPECT_EQ(table->rows[0].layer_height_mm, 0.2);
  EXPECT_EQ(table->rows[1].count, 2);  // 0.2 and 0.201 mm are one height
  EXPECT_EQ(table->rows[2].layer_height_mm, 0.3);
  ASSERT_TRUE(table->over_flow.per_unit.good());
  EXPECT_NEAR(table->over_flow.per_unit.quantity().value, 0, 1e-12);
  EXPECT_FALSE(table->laws.bends);
  EXPECT_TRUE(table->laws_layer_height_mm);
  ASSERT_THAT(table->notices, SizeIs(1));
  EXPECT_THAT(table->notices[0], HasSubstr("the layers are 0.2 and 0.3 mm high"));
  EXPECT_THROW((void)AdaptiveRows(*table), Bug);
  // The same rows without their heights.
  auto blind = table->rows;
  for (FlowPoint& row : blind) row.layer_height_mm.reset();
  const auto mixed = MakeFlowTable(blind);
  ASSERT_TRUE(mixed);
  EXPECT_TRUE(mixed->over_flow.significant);
  EXPECT_THAT(LayerHeights_mm(mixed->rows), IsEmpty());
}

TEST(FlowTable, OneLayerHeightLeavesTheTableAsItIsWithoutAny) {
  const std::vector<FlowPoint> points = {Point(5, 2000, 0.050), Point(10, 2000, 0.044)};
  std::vector<FlowPoint> known;
  for (const FlowPoint& point : points) known.push_back(InLayers(0.25, point));
  const auto without = MakeFlowTable(points);
  const auto with = MakeFlowTable(known);
  ASSERT_TRUE(without);
  ASSERT_TRUE(with);
  EXPECT_EQ(with->over_flow.per_unit.quantity().value,
            without->over_flow.per_unit.quantity().value);
  EXPECT_THAT(with->notices, IsEmpty());
  EXPECT_FALSE(with->laws_layer_height_mm);
  EXPECT_THAT(AdaptiveRows(*with), SizeIs(2));
}

TEST(FlowTable, RefusesWhatIsNoNumber) {
  EXPECT_FALSE(MakeFlowTable({InLayers(0, Point(5, 2000, 0.04))}));
  EXPECT_FALSE(MakeFlowTable({InLayers(std::nan(""), Point(5, 2000, 0.04))}));
  EXPECT_FALSE(MakeFlowTable({}));
  EXPECT_FALSE(MakeFlowTable({Point(0, 2000, 0.04)}));
  EXPECT_FALSE(MakeFlowTable({Point(5, std::numeric_limits<double>::infinity(), 0.04)}));
  EXPECT_FALSE(MakeFlowTable({Point(5, 2000, 0.04, 0)}));
}

constexpr double kSlow_mm3_s = 0.55;  // 5 mm/s of the default's bead

std::vector<AdvanceValue> Values(const std::vector<double>& flows_mm3_s, double sigma_s,
                                 const std::function<double(double)>& stored_mm3) {
  std::vector<AdvanceValue> values;
  for (const double flow : flows_mm3_s) {
    const double value_s = (stored_mm3(flow) - stored_mm3(kSlow_mm3_s)) / (flow - kSlow_mm3_s);
    values.push_back({kSlow_mm3_s, flow, value_s, sigma_s});
  }
  return values;
}

std::vector<AdvanceValue> Noisy(std::vector<AdvanceValue> values, Random& random) {
  for (AdvanceValue& value : values) value.value_s += value.sigma_s * random.Normal();
  return values;
}

const std::vector<double> kThreeFlows = {6.6, 11, 16.6};

TEST(AdvanceModel, FindsTheFormAndTheNumbersThatFirmwareHas) {
  const auto tanh = Values({3, 6.6, 11, 16.6}, 1e-6, [](double flow_mm3_s) {
    return 0.02 * flow_mm3_s + 0.15 * std::tanh(flow_mm3_s / 4);
  });
  const auto reciprocal = Values({3, 6.6, 11, 16.6}, 1e-6, [](double flow_mm3_s) {
    return 0.02 * flow_mm3_s + 0.15 * (1 - 1 / (1 + flow_mm3_s / 4));
  });
  for (const auto& [values, form] :
       {std::pair{tanh, AdvanceForm::kTanh}, {reciprocal, AdvanceForm::kReciprocal}}) {
    const AdvanceModels laws = FitAdvanceModels(values);
    ASSERT_TRUE(laws.firmware);
    EXPECT_EQ(laws.firmware->form, form);
    EXPECT_NEAR(laws.firmware->linear_s, 0.02, 0.002);
    EXPECT_NEAR(laws.firmware->offset_mm3, 0.15, 0.015);
    EXPECT_NEAR(laws.firmware->shape, 4, 0.4);
    EXPECT_LT(laws.greatest_miss_s, 1e-4);
  }
}

TEST(AdvanceModel, IntervalsOfTheExponentHoldItAndAStraightLawIsRarelySaidToBend) {
  constexpr int kWorlds = 400;
  for (const std::vector<double>& flows :
       {std::vector<double>{8, 16.6}, kThreeFlows, std::vector<double>{3, 6.6, 11, 16.6}}) {
    for (const double exponent : {0.3, 0.6, 0.8, 1.0}) {
      int held = 0, bent = 0;
      for (int world = 0; world < kWorlds; ++world) {
        Random random(9100 + static_cast<std::uint64_t>(world));
        const auto values = Noisy(Values(flows, 0.0008,
                                         [&](double flow_mm3_s) {
                                           return 0.04 * 11 * std::pow(flow_mm3_s / 11, exponent);
                                         }),
                                  random);
        const AdvanceModels laws = FitAdvanceModels(values);
        ASSERT_TRUE(laws.exponent.good()) << laws.exponent.reason();
        const Interval& interval = laws.exponent.quantity().interval95;
        held += interval.lo <= exponent && exponent <= interval.hi;
        bent += laws.bends;
      }
      EXPECT_GE(held, 0.93 * kWorlds) << flows.size() << " flows, " << exponent;
      if (exponent == 1) EXPECT_LE(bent, 0.07 * kWorlds) << flows.size();
    }
  }
}

TEST(AdvanceModel, CannotTellFromTooLittle) {
  const auto straight = [](double q) { return 0.04 * q; };
  for (const auto& values : {std::vector<AdvanceValue>{}, Values({8}, 0.0008, straight),
                             Values({8, 8.1, 8.5}, 0.0008, straight)}) {
    const AdvanceModels laws = FitAdvanceModels(values);
    EXPECT_EQ(laws.exponent.verdict(), Verdict::kCannotTell);
    EXPECT_THAT(laws.exponent.reason(), HasSubstr("two flows"));
    EXPECT_FALSE(laws.bends);
  }
  const AdvanceModels unsure = FitAdvanceModels(Values({8, 12}, 0.05, straight));
  EXPECT_EQ(unsure.exponent.verdict(), Verdict::kCannotTell);
  EXPECT_THAT(unsure.exponent.reason(), HasSubstr("any law fits"));
  // Two flows tell that it bends, not how.
  const AdvanceModels two =
      FitAdvanceModels(Values({8, 16}, 0.0005, [](double q) { return 0.1 * std::sqrt(q); }));
  EXPECT_TRUE(two.bends);
  EXPECT_FALSE(two.firmware);
}

// Results are read from files: numbers that no printer has end in a verdict all the same.
TEST(AdvanceModel, SurvivesNumbersThatNoPrinterHas) {
  for (const double value_s : {-1.0, 0.0, 1e-300, 1e300}) {
    for (const double sigma_s : {1e-300, 1e-12, 1e300}) {
      for (const double flow : {1e-9, 1.0, 1e200}) {
        const std::vector<AdvanceValue> values = {{0, flow, value_s, sigma_s},
                                                  {0, 2 * flow, value_s, sigma_s},
                                                  {flow, 4 * flow, value_s, sigma_s}};
        const AdvanceModels laws = FitAdvanceModels(values);
        if (!laws.exponent.good()) continue;
        const Interval& interval = laws.exponent.quantity().interval95;
        EXPECT_LE(interval.lo, laws.exponent.quantity().value);
        EXPECT_GE(interval.hi, laws.exponent.quantity().value);
      }
    }
  }
}

}  // namespace
}  // namespace trammel::pressure_advance
