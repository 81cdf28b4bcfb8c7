#include "tap/ensemble/method_comparison.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <functional>
#include <utility>

#include "base/random.h"

namespace trammel::tap {
namespace {

using ::testing::AllOf;
using ::testing::HasSubstr;

/// @param place  x of the place.
TwiceRead Tap(double two_line_mm, double contact_mm, double place_mm = 10) {
  TwiceRead tap;
  tap.two_line = {.good = true, .z_mm = two_line_mm, .standard_uncertainty_mm = 0.002};
  tap.contact = {.good = true, .z_mm = contact_mm, .standard_uncertainty_mm = 0.001};
  tap.contact.x_mm = place_mm;
  tap.contact.y_mm = 20;
  return tap;
}

/// Heights of the machine's own deviation 1 um, to which each method adds its own error.
std::vector<TwiceRead> Draw(std::size_t taps, double two_line_um, double contact_um, Random& random,
                            const std::function<double(Random&)>& error) {
  constexpr double kMmPerUm = 1e-3;
  std::vector<TwiceRead> drawn;
  for (std::size_t i = 0; i < taps; ++i) {
    const double truth = random.Normal();
    drawn.push_back(Tap(kMmPerUm * (truth + two_line_um * error(random)),
                        kMmPerUm * (truth + contact_um * error(random))));
  }
  return drawn;
}

double Normal(Random& random) { return random.Normal(); }

/// Deviation 1, excess kurtosis 5.3: one tap in ten is thrice as far off as the others.
double HeavyTail(Random& random) {
  const double size = random.Uniform(0, 1) < 0.1 ? 3 : 1;
  return size * random.Normal() / std::sqrt(0.9 + 0.9);
}

bool Holds(const Measured& measured, double truth) {
  const Interval& interval = measured.quantity().interval95;
  return interval.lo <= truth && truth <= interval.hi;
}

TEST(MethodComparison, GivesTheDeviationsOfHandWorkedTaps) {
  std::vector<TwiceRead> taps;
  for (int i = 0; i < 10; ++i) taps.push_back(Tap(i % 2 == 0 ? 0.004 : 0, i % 2 == 0 ? 0.001 : 0));
  const MethodComparison found = CompareMethods(taps);
  ASSERT_TRUE(found.ratio.good()) << found.because;
  // Ten heights that alternate by 2 a about their mean: a sqrt(10 / 9); steps 2 a, over sqrt 2.
  EXPECT_NEAR(found.two_line.deviation_mm.quantity().value, 0.002 * std::sqrt(10.0 / 9), 1e-12);
  EXPECT_NEAR(found.contact.deviation_mm.quantity().value, 0.0005 * std::sqrt(10.0 / 9), 1e-12);
  EXPECT_NEAR(found.two_line.back_to_back_mm.quantity().value, 0.004 / std::sqrt(2), 1e-12);
  EXPECT_NEAR(found.ratio.quantity().value, 0.25, 1e-12);
  EXPECT_NEAR(found.difference_mm.quantity().value, -0.0015, 1e-12);
  EXPECT_EQ(found.better, Repeats::kContactBetter);
  EXPECT_DOUBLE_EQ(found.two_line.claimed_mm, 0.002);
  EXPECT_NEAR(found.residuals[0].two_line.z_mm, 0.002, 1e-12);
}

/// Draws of 95 % within three standard deviations of a share of 1000 draws.
constexpr double kLeastCover = 0.95 - 3 * 0.0069;
/// Heavy tails leave the jackknife short at twenty taps (Miller 1968: 0.90 to 0.93).
constexpr double kLeastHeavyCover = 0.89;

struct Cover {
  double ratio = 0;
  double back_to_back = 0;
  double deviation = 0;
};

Cover CoverOf(std::size_t taps, double two_line_um, double contact_um,
              const std::function<double(Random&)>& error) {
  constexpr int kDraws = 1000;
  Random random(1001);
  Cover cover;
  const double two_line = std::hypot(1, two_line_um);
  const double contact = std::hypot(1, contact_um);
  for (int i = 0; i < kDraws; ++i) {
    const MethodComparison found =
        CompareMethods(Draw(taps, two_line_um, contact_um, random, error));
    cover.ratio += Holds(found.ratio, contact / two_line) ? 1.0 / kDraws : 0;
    cover.back_to_back += Holds(found.back_to_back_ratio, contact / two_line) ? 1.0 / kDraws : 0;
    cover.deviation += Holds(found.contact.deviation_mm, contact * 1e-3) ? 1.0 / kDraws : 0;
  }
  return cover;
}

TEST(MethodComparison, IntervalsCoverTheTruthOfNormalHeights) {
  for (const auto& [taps, two_line_um] :
       {std::pair<std::size_t, double>{9, 3}, {20, 0.5}, {100, 3}}) {
    const Cover cover = CoverOf(taps, two_line_um, 0.5, Normal);
    EXPECT_GE(cover.ratio, kLeastCover) << taps << ' ' << two_line_um;
    EXPECT_GE(cover.back_to_back, kLeastCover) << taps << ' ' << two_line_um;
    EXPECT_GE(cover.deviation, kLeastCover) << taps << ' ' << two_line_um;
  }
}

TEST(MethodComparison, IntervalsAllowForHeavyTails) {
  const Cover cover = CoverOf(20, 3, 0.5, HeavyTail);
  EXPECT_GE(cover.ratio, kLeastHeavyCover);
  EXPECT_GE(cover.deviation, kLeastHeavyCover);
}

TEST(MethodComparison, NamesEqualMethodsBetterInOneSeriesOfTwenty) {
  constexpr int kDraws = 1000;
  Random random(1002);
  double named = 0;
  for (int i = 0; i < kDraws; ++i) {
    const MethodComparison found = CompareMethods(Draw(15, 1, 1, random, Normal));
    named += found.better != Repeats::kCannotTell ? 1.0 / kDraws : 0;
  }
  EXPECT_LE(named, 1 - kLeastCover);
}

TEST(MethodComparison, AMeshCountsAboutEachPointsMean) {
  Random random(1003);
  std::vector<TwiceRead> mesh;
  for (int run = 0; run < 2; ++run) {
    for (int point = 0; point < 25; ++point) {
      const double bed_mm = 0.3 * std::sin(point);
      mesh.push_back(
          Tap(bed_mm + 0.003 * random.Normal(), bed_mm + 0.001 * random.Normal(), 10.0 * point));
    }
  }
  const MethodComparison found = CompareMethods(mesh);
  ASSERT_TRUE(found.ratio.good()) << found.because;
  EXPECT_EQ(found.places, 25U);
  EXPECT_EQ(found.used, 50U);
  EXPECT_TRUE(Holds(found.two_line.deviation_mm, 0.003));
  EXPECT_TRUE(Holds(found.contact.back_to_back_mm, 0.001));
  EXPECT_EQ(found.better, Repeats::kContactBetter);
}

TEST(MethodComparison, ASlowDriftIsNotInTheStepsBackToBack) {
  Random random(1004);
  std::vector<TwiceRead> taps = Draw(50, 0.1, 0.1, random, Normal);
  for (std::size_t i = 0; i < taps.size(); ++i) {
    taps[i].two_line.z_mm += 0.001 * static_cast<double>(i);
    taps[i].contact.z_mm += 0.001 * static_cast<double>(i);
  }
  const MethodComparison found = CompareMethods(taps);
  // 50 um over 50 taps: 14.6 um about the mean, and 0.7 um in each step's height.
  EXPECT_GT(found.contact.deviation_mm.quantity().value, 0.010);
  EXPECT_LT(found.contact.back_to_back_mm.quantity().value, 0.0025);
}

TEST(MethodComparison, UsesOnlyTapsThatBothMethodsRead) {
  Random random(1005);
  std::vector<TwiceRead> taps = Draw(20, 3, 1, random, Normal);
  const MethodComparison whole = CompareMethods(taps);
  taps.push_back(Tap(9, 9));
  taps.back().two_line.good = false;
  taps.push_back(Tap(-9, -9));
  taps.back().contact.good = false;
  const MethodComparison found = CompareMethods(taps);
  EXPECT_EQ(found.taps, 22U);
  EXPECT_EQ(found.used, 20U);
  EXPECT_EQ(found.two_line.good, 21U);
  EXPECT_DOUBLE_EQ(found.ratio.quantity().value, whole.ratio.quantity().value);
  EXPECT_TRUE(std::isnan(found.residuals[20].contact.z_mm));
}

TEST(MethodComparison, SaysWhatIsMissingWhereTapsAreTooFew) {
  Random random(1006);
  EXPECT_FALSE(CompareMethods({}).ratio.good());
  const MethodComparison eight = CompareMethods(Draw(8, 3, 1, random, Normal));
  EXPECT_EQ(eight.ratio.verdict(), Verdict::kCannotTell);
  EXPECT_THAT(eight.because, AllOf(HasSubstr("8 of 8 taps"), HasSubstr("7 degrees of freedom")));
  EXPECT_TRUE(CompareMethods(Draw(9, 3, 1, random, Normal)).ratio.good());
  std::vector<TwiceRead> once = Draw(25, 3, 1, random, Normal);
  for (std::size_t i = 0; i < once.size(); ++i)
    once[i].contact.x_mm = 10.0 * static_cast<double>(i);
  EXPECT_THAT(CompareMethods(once).because, HasSubstr("run a mesh"));
}

TEST(MethodComparison, KnowsOneTapGivenSeveralTimes) {
  const std::vector<TwiceRead> taps(12, Tap(0.001, 0.002));
  const MethodComparison found = CompareMethods(taps);
  EXPECT_FALSE(found.ratio.good());
  EXPECT_THAT(found.because, HasSubstr("same tap"));
}

}  // namespace
}  // namespace trammel::tap
