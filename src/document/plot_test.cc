#include "document/plot.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <numbers>

#include "base/random.h"
#include "document/parsers_test_support.h"

namespace trammel::report {
namespace {

const double kNan = std::numeric_limits<double>::quiet_NaN();

TEST(NiceTicks, AreRoundWithinTheRangeAndNeitherFewNorMany) {
  constexpr std::uint64_t kSeed = 11;
  Random random(kSeed);
  for (int i = 0; i < 2000; ++i) {
    const double lo = random.Uniform(-10, 10) * std::pow(10, random.Uniform(-6, 6));
    const Range range{lo, lo + std::abs(lo) * std::pow(10, random.Uniform(-3, 3))};
    const int wanted = 1 + static_cast<int>(random.Below(10));
    const auto ticks = NiceTicks(range, wanted);
    ASSERT_GE(ticks.size(), 2U) << "seed " << kSeed << " i " << i;
    ASSERT_LE(static_cast<double>(ticks.size()), std::max(4.0, 2.5 * wanted + 1))
        << "seed " << kSeed << " i " << i;
    for (const double tick : ticks) {
      const double slack = 1e-5 * (range.hi - range.lo);
      ASSERT_GE(tick, range.lo - slack);
      ASSERT_LE(tick, range.hi + slack);
    }
  }
}

TEST(TickLabels, ShowJustTheDecimalsThatTellTicksApart) {
  using Labels = std::vector<std::string>;
  EXPECT_EQ(TickLabels(NiceTicks({0, 0.06}, 6)),
            (Labels{"0.00", "0.01", "0.02", "0.03", "0.04", "0.05", "0.06"}));
  EXPECT_EQ(TickLabels(NiceTicks({-0.5, 0.5}, 2)), (Labels{"-0.5", "0.0", "0.5"}));
  EXPECT_EQ(TickLabels({0, 25, 50}), (Labels{"0", "25", "50"}));
  EXPECT_EQ(TickLabels({0.0645, 0.065, 0.0655}), (Labels{"0.0645", "0.0650", "0.0655"}));
  EXPECT_EQ(TickLabels({}), Labels{});
}

TEST(RangeOf, IsNeverEmptyAndNeverNan) {
  const std::vector<std::vector<double>> samples = {
      {}, {kNan}, {0}, {3, 3}, {-1e9, -1e9}, {1, kNan, 2}, {5, 5 + 1e-12}};
  for (const auto& sample : samples) {
    const Range range = RangeOf(sample);
    EXPECT_LT(range.lo, range.hi);
    EXPECT_TRUE(std::isfinite(range.hi - range.lo));
    EXPECT_GE(NiceTicks(range, 5).size(), 1U);
  }
  EXPECT_EQ(RangeOf(samples[5]).lo, 1);
  EXPECT_EQ(RangeOf(samples[5]).hi, 2);
}

TEST(Plot, MapsTheCornersOfTheDataToTheCornersOfTheRectangle) {
  Canvas canvas(400, 300);
  const Plot plot(canvas, {0, 0, 400, 300}, {"x (mm)", {2, 4}}, {"y (s)", {-1, 1}}, "title");
  EXPECT_NEAR(plot.X(2), plot.inner().x, 1e-9);
  EXPECT_NEAR(plot.X(4), plot.inner().right(), 1e-9);
  EXPECT_NEAR(plot.Y(-1), plot.inner().bottom(), 1e-9);
  EXPECT_NEAR(plot.Y(1), plot.inner().y, 1e-9);
  EXPECT_GT(plot.inner().x, 20);  // room for the labels
  EXPECT_LT(plot.inner().bottom(), 270);
}

TEST(Plot, LeavesOutValuesThatAreNotFinite) {
  Canvas canvas(400, 300);
  Plot plot(canvas, {0, 0, 400, 300}, {"x", {0, 1}}, {"y", {0, 1}});
  const DataPoint points[] = {{0, 0}, {0.5, kNan}, {1, std::numeric_limits<double>::infinity()}};
  plot.Line(points, {});
  plot.Band(points, points, kSky);
  plot.Dot({kNan, 1}, 3, kBlue);
  plot.ErrorBar({0.5, 0.5}, kNan, {});
  plot.VerticalLine(kNan, {});
  plot.ShadeX({kNan, kNan}, kSky);
  const std::string svg = canvas.ToSvg();
  EXPECT_EQ(test::XmlProblem(svg), "");
  EXPECT_EQ(svg.find("nan"), std::string::npos);
}

TEST(Plot, RejectsAnEmptyRange) {
  Canvas canvas(400, 300);
  EXPECT_THROW(Plot(canvas, {0, 0, 400, 300}, {"x", {1, 1}}, {"y", {0, 1}}), Bug);
}

TEST(ColorGrid, ShowsUnmeasuredValuesInGreyAndTheRestByTheMap) {
  const Frame image = ColorGrid({3, 1, {0.0, kNan, 1.0}}, {0, 1});
  ASSERT_EQ(image.width, 3);
  ASSERT_EQ(image.height, 1);
  EXPECT_NEAR(image.bgr[2], MapColor(0).red * 255, 0.5);
  EXPECT_NEAR(image.bgr[3], kUnseen.blue * 255, 0.5);
  EXPECT_NEAR(image.bgr[8], MapColor(1).red * 255, 0.5);
  EXPECT_THROW((void)ColorGrid({2, 2, {1.0}}, {0, 1}), Bug);
}

}  // namespace
}  // namespace trammel::report
