#include "tool_offset/original/original_sheet.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <map>
#include <set>

namespace trammel::tool_offset {
namespace {

constexpr double kExact_mm = 1e-9;

OriginalSheet OfTools(const std::vector<int>& tools) {
  OriginalSheet sheet;
  sheet.tools = tools;
  sheet.moved.assign(tools.size(), {});
  return sheet;
}

TEST(OriginalSheet, HasThePublishedBoxForEveryNumberOfTools) {
  const std::map<int, std::pair<double, double>> published{
      {2, {122, 78}}, {3, {144, 78}}, {4, {166, 95}}, {5, {188, 117}}};
  for (const auto& [count, size] : published) {
    const SheetPlan plan =
        PlanOriginal(OfTools(std::vector<int>(static_cast<std::size_t>(count), 1)));
    EXPECT_NEAR(plan.width_mm, size.first, kExact_mm);
    EXPECT_NEAR(plan.height_mm, size.second, kExact_mm);
  }
}

TEST(OriginalSheet, ShiftsBothCombsByHalfAPitchOnEitherSide) {
  const SheetPlan plan = PlanOriginal(OfTools({1, 2, 3}));
  for (const Structure& structure : plan.structures) {
    const std::size_t reference = structure.swapped ? 0 : 1;
    EXPECT_EQ(structure.combs[reference].tool, plan.settings.reference_tool);
    const double apart_mm =
        FingerPosition_mm(plan, structure, 1, 0) - FingerPosition_mm(plan, structure, 0, 0);
    EXPECT_NEAR(apart_mm, 2, kExact_mm);
    EXPECT_FALSE(structure.FromLowSide(reference));
    // Each spine's legs on its side, 8 mm apart.
    const Leg low = FingerLegs(plan, structure, 1 - reference, 3)[0];
    const Leg high = FingerLegs(plan, structure, reference, 3)[0];
    const auto across = [&](const SheetPoint& p) {
      return structure.axis == Axis::kX ? p.v_mm : p.u_mm;
    };
    EXPECT_NEAR(std::max(across(high.start), across(high.end)) -
                    std::min(across(low.start), across(low.end)),
                8, kExact_mm);
  }
}

TEST(OriginalSheet, DrawsEachFingerThereAndBack) {
  const SheetPlan plan = PlanOriginal(OfTools({1, 2}));
  for (const Structure& structure : plan.structures) {
    for (const std::size_t comb : {std::size_t{0}, std::size_t{1}}) {
      const auto legs = FingerLegs(plan, structure, comb, 5);
      const bool is_x = structure.axis == Axis::kX;
      const auto way = [&](const Leg& leg) {
        return is_x ? leg.end.v_mm - leg.start.v_mm : leg.end.u_mm - leg.start.u_mm;
      };
      EXPECT_NEAR(way(legs[0]), -way(legs[1]), kExact_mm);
      // The first leg leads from the spine into the overlap.
      const Leg& first = legs[structure.combs[comb].direction > 0 ? 0 : 1];
      EXPECT_EQ(way(first) > 0, structure.FromLowSide(comb));
    }
  }
}

TEST(OriginalSheet, KeepsAllOfItsInkInItsBoxAndItsNamesApart) {
  for (const std::vector<int>& tools : {std::vector{2, 2, 1, 1, 2}, {7}, {3, 4, 5, 6}}) {
    const SheetPlan plan = PlanOriginal(OfTools(tools));
    std::set<std::string> names;
    for (const Structure& structure : plan.structures) names.insert(structure.name);
    EXPECT_EQ(names.size(), plan.structures.size());
    EXPECT_EQ(plan.structures.size(), 4 * tools.size());
    for (const int tool : plan.settings.tools) {
      for (const Leg& leg : LegsOfTool(plan, tool)) {
        for (const SheetPoint& point : {leg.start, leg.end}) {
          constexpr double kMargin_mm = 3;
          EXPECT_LT(std::abs(point.u_mm), plan.width_mm / 2 - kMargin_mm);
          EXPECT_LT(std::abs(point.v_mm), plan.height_mm / 2 - kMargin_mm);
        }
      }
    }
  }
}

TEST(OriginalSheet, CountsTheReferenceToolsOwnPairsAsControls) {
  OriginalSheet sheet = OfTools({2, 1, 2});
  sheet.moved[2] = {0.1, 0};
  const SheetPlan plan = PlanOriginal(sheet);
  std::map<Purpose, int> count;
  for (const Structure& structure : plan.structures) ++count[structure.purpose];
  EXPECT_EQ(count[Purpose::kControl], 4);
  EXPECT_EQ(count[Purpose::kTool], 4);
  EXPECT_EQ(count[Purpose::kSelfTest], 4);
}

TEST(OriginalSheet, AlwaysSaysThatItsIdentityIsNotChecked) {
  using ::testing::HasSubstr;
  EXPECT_THAT(PlanOriginal(OfTools({1, 2})).notices,
              ::testing::ElementsAre(HasSubstr("identity not checked")));
  EXPECT_THAT(PlanOriginal(OfTools({1, 3})).notices,
              ::testing::ElementsAre(HasSubstr("identity not checked"), HasSubstr("no control")));
}

TEST(OriginalSheet, RefusesWhatCannotBeOne) {
  EXPECT_FALSE(Validate(OfTools({})));
  EXPECT_FALSE(Validate(OfTools({1, 2, 3, 4, 5, 6})));
  EXPECT_FALSE(Validate(OfTools({1, -1})));
  OriginalSheet sheet = OfTools({1, 2});
  sheet.rotation_deg = 45;
  EXPECT_FALSE(Validate(sheet));
  sheet = OfTools({1, 2});
  sheet.moved[0] = {0.6, 0};
  EXPECT_FALSE(Validate(sheet));
  EXPECT_TRUE(Validate(OfTools({1, 2})));
}

}  // namespace
}  // namespace trammel::tool_offset
