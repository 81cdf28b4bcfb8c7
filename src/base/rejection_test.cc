#include "base/rejection.h"

#include <gtest/gtest.h>

#include <functional>
#include <string>

namespace trammel {
namespace {

// Each of these pictures shows each of these targets.
AdjustmentCheck CheckOf(int pictures, int targets,
                        const std::function<bool(int picture, int target)>& rejected) {
  RejectionTally tally;
  for (int p = 0; p < pictures; ++p) {
    for (int t = 0; t < targets; ++t) {
      tally.Add({"picture " + std::to_string(p), "target " + std::to_string(t)}, rejected(p, t));
    }
  }
  return tally.Check(2 * pictures * targets - 6 * pictures - 3 * targets + 7);
}

TEST(Rejection, OfUpToATwentiethOfTheObservationsIsThatOfOutliers) {
  for (int rejected = 0; rejected <= 400; ++rejected) {
    // Spread as evenly as can be: no picture and no target has more than its share.
    const auto check =
        CheckOf(20, 20, [&](int p, int t) { return 20 * ((p + t) % 20) + p < rejected; });
    EXPECT_EQ(check.rejected, rejected);
    const int of_one = (rejected + 19) / 20;  // rejected at the worst target or picture
    EXPECT_EQ(check.contradiction.empty(), rejected - of_one <= 20) << rejected;
  }
}

TEST(Rejection, OfOnePictureOrOneTargetIsThatOfOutliersHoweverLargeItsShare) {
  for (const int pictures : {2, 4, 6, 30}) {
    for (const int targets : {2, 5, 12}) {
      EXPECT_EQ(CheckOf(pictures, targets, [](int p, int) { return p == 1; }).contradiction, "");
      EXPECT_EQ(CheckOf(pictures, targets, [](int, int t) { return t == 1; }).contradiction, "");
    }
  }
}

TEST(Rejection, OfHalfThePartNamesTheTargetThatContradictsMost) {
  const auto check = CheckOf(10, 12, [](int p, int t) { return t >= 6 && p >= (t == 8 ? 3 : 5); });
  EXPECT_EQ(check.observations, 120);
  EXPECT_EQ(check.rejected, 32);
  EXPECT_DOUBLE_EQ(check.rejected_share(), 32.0 / 120);
  EXPECT_EQ(check.contradiction,
            "32 of 120 observations (27 %) contradict the others; outliers are 5 % and one whole "
            "picture or target at most; target 8 contradicts most: 7 of its 10");
  EXPECT_EQ(CheckText(check), "redundancy 151; 32 of 120 observations rejected (26.7 %)");
}

TEST(Rejection, OfTwoWholePicturesOfTenIsNotThatOfOutliers) {
  EXPECT_NE(CheckOf(10, 12, [](int p, int) { return p < 2; }).contradiction, "");
}

TEST(Rejection, OfNothingIsNone) {
  const AdjustmentCheck check = RejectionTally().Check(0);
  EXPECT_EQ(check.contradiction, "");
  EXPECT_EQ(check.rejected_share(), 0);
}

}  // namespace
}  // namespace trammel
