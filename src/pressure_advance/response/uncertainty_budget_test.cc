#include "pressure_advance/response/uncertainty_budget.h"

#include <gtest/gtest.h>

#include <string>

namespace trammel::pressure_advance {
namespace {

constexpr Interval kTested{0, 0.06};

std::string ReasonOf(const UncertaintyBudget& budget) {
  return JudgeByBudget(0.03, budget, 7, kTested, 0.1).pressure_advance.reason();
}

TEST(UncertaintyBudget, BlamesTheLargestContributionForAnIntervalThatIsTooWide) {
  constexpr double kMuch_s2 = 4e-5;
  EXPECT_NE(ReasonOf({.lines = kMuch_s2}).find("print more lines"), std::string::npos);
  for (const UncertaintyBudget& budget : {UncertaintyBudget{.unread = kMuch_s2},
                                          UncertaintyBudget{.lines = 1e-6, .unread = kMuch_s2}}) {
    EXPECT_NE(ReasonOf(budget).find("crop_px"), std::string::npos) << ReasonOf(budget);
    EXPECT_EQ(ReasonOf(budget).find("more lines"), std::string::npos) << ReasonOf(budget);
  }
  EXPECT_NE(ReasonOf({.slip = kMuch_s2}).find("may be lost at the fast speed"), std::string::npos);
  EXPECT_NE(ReasonOf({.drift = kMuch_s2}).find("drift"), std::string::npos);
  EXPECT_NE(ReasonOf({.form = kMuch_s2}).find("outlasts"), std::string::npos);
  EXPECT_NE(ReasonOf({.apart = kMuch_s2}).find("contradict"), std::string::npos);
}

TEST(UncertaintyBudget, WidensByStudentsTForTheLinesPartAlone) {
  const auto half_s = [](const UncertaintyBudget& budget) {
    const Quantity q = JudgeByBudget(0.03, budget, 2, kTested, 1).pressure_advance.quantity();
    return (q.interval95.hi - q.interval95.lo) / 2;
  };
  EXPECT_NEAR(half_s({.lines = 1e-6}), 4.303e-3, 1e-6);
  EXPECT_NEAR(half_s({.slip = 1e-6}), 1.960e-3, 1e-6);
}

}  // namespace
}  // namespace trammel::pressure_advance
