#include "tool_offset/original/original_sheet.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <map>
#include <set>

namespace trammel::tool_offset {
namespace {

OriginalSheet OfTools(const std::vector<int>& tools) {
  OriginalSheet sheet;
  sheet.tools = tools;
  sheet.moved.assign(tools.size(), {});
  return sheet;
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
