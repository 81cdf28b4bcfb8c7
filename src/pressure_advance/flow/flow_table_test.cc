#include "pressure_advance/flow/flow_table.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <vector>

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

// Of filaments that do not depend on flow 5 % are meant to be said to; of those that do, nearly
// all.
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

TEST(FlowTable, CannotTellFromOneFlow) {
  const auto table = MakeFlowTable({Point(5, 2000, 0.04), Point(5, 4000, 0.03)});
  ASSERT_TRUE(table);
  EXPECT_FALSE(table->over_flow.per_unit.good());
  EXPECT_THAT(table->over_flow.per_unit.reason(), HasSubstr("differ in flow alone"));
  EXPECT_FALSE(table->over_flow.significant);
  EXPECT_TRUE(table->over_acceleration.significant);
  EXPECT_THAT(AdaptiveRows(*table), IsEmpty());
}

TEST(FlowTable, SaysWhereRowsDoNotCompare) {
  FlowPoint other = Point(10, 2000, 0.04);
  other.slow_flow_mm3_s = 6;
  const auto table = MakeFlowTable({Point(5, 2000, 0.04), other});
  ASSERT_TRUE(table);
  ASSERT_THAT(table->notices, SizeIs(2));
  EXPECT_THAT(table->notices[0], HasSubstr("slow stretches differ"));
  EXPECT_THAT(table->notices[1], HasSubstr("small change of flow"));
}

TEST(FlowTable, RefusesWhatIsNoNumber) {
  EXPECT_FALSE(MakeFlowTable({}));
  EXPECT_FALSE(MakeFlowTable({Point(0, 2000, 0.04)}));
  EXPECT_FALSE(MakeFlowTable({Point(5, std::numeric_limits<double>::infinity(), 0.04)}));
  EXPECT_FALSE(MakeFlowTable({Point(5, 2000, 0.04, 0)}));
}

}  // namespace
}  // namespace trammel::pressure_advance
