// Crossing of the corners' surplus.
#include "pressure_advance/response/corner_response.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "base/random.h"

namespace trammel::pressure_advance {
namespace {

using ::testing::HasSubstr;

// Surplus that a corner's round outside takes at any pressure advance.
constexpr double kRound_mm = -0.12;

// Falls at 20 mm/s and bottoms out 20 ms beyond the right value, as gaps that are empty do.
std::vector<CornerSurplus> Corners(double right_s, double noise_mm, std::uint64_t seed) {
  Random random(seed);
  std::vector<CornerSurplus> corners;
  for (int i = 0; i <= 16; ++i) {
    const double p = 0.005 * i;
    const double surplus = std::max(20 * (right_s - p), -0.4);
    corners.push_back({p, surplus + kRound_mm + noise_mm * random.Normal(), 0.01, 0, ""});
  }
  return corners;
}

constexpr CornerMotion kMotion{100, 3000, 0};

TEST(CornerResponse, CrossesZeroAtTheRightValueInsideItsInterval) {
  for (const double right_s : {0.02, 0.035, 0.06}) {
    for (std::uint64_t seed = 1; seed <= 10; ++seed) {
      const Analysis analysis = FitCorners(Corners(right_s, 0.05, seed), kMotion);
      ASSERT_TRUE(analysis.pressure_advance.good()) << analysis.pressure_advance.reason();
      const Quantity& q = analysis.pressure_advance.quantity();
      EXPECT_NEAR(q.value, right_s, 0.004) << seed;
      EXPECT_LE(q.interval95.lo, right_s) << seed;
      EXPECT_GE(q.interval95.hi, right_s) << seed;
    }
  }
}

TEST(CornerResponse, GivesNoNumberOutsideOfTheRangeOrWithoutAResponse) {
  const Analysis above = FitCorners(Corners(0.1, 0.05, 1), kMotion);
  EXPECT_EQ(above.pressure_advance.verdict(), Verdict::kCannotTell);
  EXPECT_THAT(FitCorners(Corners(0.003, 0.05, 1), kMotion).pressure_advance.reason(),
              HasSubstr("corners do not tell so low a value"));
  std::vector<CornerSurplus> flat = Corners(0.04, 0.05, 2), rising = flat;
  for (CornerSurplus& corner : flat)
    corner.surplus_mm = corner.pressure_advance_s > 0.04 ? 0.05 : -0.05;
  for (CornerSurplus& corner : rising) corner.surplus_mm *= -1;
  EXPECT_EQ(FitCorners(flat, kMotion).pressure_advance.verdict(), Verdict::kCannotTell);
  EXPECT_EQ(FitCorners(rising, kMotion).pressure_advance.verdict(), Verdict::kCannotTell);
}

// Dips of 20 ms and 200 ms: a smooth time of 40 ms raises the crossing by up to 14 and by 2 ms.
TEST(CornerResponse, SmoothingIsTakenOffAndWidensTheMoreTheShorterTheDip) {
  const auto corners = Corners(0.04, 0.02, 1);
  const Quantity plain = FitCorners(corners, kMotion).pressure_advance.quantity();
  const Quantity brief = FitCorners(corners, {200, 20000, 0.04}).pressure_advance.quantity();
  const Quantity slow = FitCorners(corners, {100, 1000, 0.04}).pressure_advance.quantity();
  EXPECT_NEAR(plain.value - brief.value, 0.007, 1e-9);
  EXPECT_NEAR(plain.value - slow.value, 0.001, 1e-9);
  const Quantity unknown = FitCorners(corners, {}).pressure_advance.quantity();
  EXPECT_NEAR(plain.value - unknown.value, 0.002, 1e-9);
  EXPECT_GT(unknown.standard_uncertainty, plain.standard_uncertainty);
  EXPECT_NEAR(brief.standard_uncertainty, std::hypot(plain.standard_uncertainty, 0.014 / 3), 1e-9);
}

// A shadow beside one arm of each corner changes its area by as much as the right value does.
TEST(CornerResponse, ShadowsWidenTheIntervalAndAreNamed) {
  std::vector<CornerSurplus> corners = Corners(0.04, 0.02, 1);
  for (CornerSurplus& corner : corners) corner.wider = -0.05;
  const Quantity even = FitCorners(Corners(0.04, 0.02, 1), kMotion).pressure_advance.quantity();
  const Quantity shaded = FitCorners(corners, kMotion).pressure_advance.quantity();
  EXPECT_EQ(shaded.value, even.value);
  EXPECT_NEAR(shaded.standard_uncertainty, std::hypot(even.standard_uncertainty, 0.05 / 20), 2e-4);
  for (CornerSurplus& corner : corners) corner.wider = 0.2;
  EXPECT_THAT(FitCorners(corners, kMotion).pressure_advance.reason(),
              HasSubstr("look 20 % wider than those on the other, as shadows make them"));
}

TEST(CornerResponse, NeedsSixCornersAndSaysWhy) {
  std::vector<CornerSurplus> corners = Corners(0.04, 0.02, 1);
  for (std::size_t i = 5; i < corners.size(); ++i) corners[i].unusable = "glare";
  const Analysis analysis = FitCorners(corners, kMotion);
  EXPECT_EQ(analysis.pressure_advance.verdict(), Verdict::kRefused);
  EXPECT_THAT(analysis.pressure_advance.reason(), HasSubstr("5 of 17 corners"));
  EXPECT_EQ(analysis.lines.back().reason, "glare");
}

}  // namespace
}  // namespace trammel::pressure_advance
