#include "part_alignment/part_fit/scale_bars.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>

#include "base/random.h"

namespace trammel::part_alignment {
namespace {

using ::testing::HasSubstr;

// Bars of these lengths in a measurement in which 1 mm is `unit` long; each known to sigma_mm, and
// found to as much.
FoundBars BarsOf(const std::vector<double>& lengths_mm, double unit, double sigma_mm) {
  FoundBars found;
  const auto count = std::ssize(lengths_mm);
  found.lengths.resize(count);
  found.covariance.setZero(count, count);
  for (Eigen::Index i = 0; i < count; ++i) {
    const double length_mm = lengths_mm[static_cast<std::size_t>(i)];
    const std::string end = std::to_string(901 + 2 * i);
    found.bars.push_back({end, std::to_string(902 + 2 * i), length_mm, sigma_mm});
    found.lengths[i] = unit * length_mm;
    found.covariance(i, i) = std::pow(sigma_mm / length_mm, 2);
  }
  return found;
}

TEST(ScaleBars, GiveTheScaleOfAnyUnit) {
  for (const double unit : {1e-6, 0.37, 1.0, 5e4}) {
    const BarScale scale = TestBars(BarsOf({1000, 700, 1250}, unit, 0.01));
    EXPECT_NEAR(scale.scale * unit, 1, 1e-12);
    EXPECT_EQ(scale.fault, "");
    EXPECT_EQ(scale.unchecked, "");
    for (const BarTest& bar : scale.bars) {
      EXPECT_TRUE(bar.used);
      EXPECT_NEAR(bar.misclosure_mm, 0, 1e-9);
      EXPECT_GT(bar.detectable_mm, 0.04);
    }
  }
}

TEST(ScaleBars, OneAloneIsUncheckedWhateverItsLength) {
  const BarScale scale = TestBars(BarsOf({1000}, 1, 0.01));
  EXPECT_EQ(scale.fault, "");
  EXPECT_THAT(scale.unchecked, HasSubstr("one bar alone, 901-902"));
  EXPECT_NEAR(scale.sigma, std::sqrt(2.0) * 1e-5, 1e-12);
  EXPECT_EQ(scale.bars[0].detectable_mm, 0);
}

TEST(ScaleBars, TwoThatDisagreeAreAFaultOfBoth) {
  for (const double by_mm : {-900.0, -0.3, 0.3, 900.0}) {
    FoundBars found = BarsOf({1000, 1200}, 0.01, 0.01);
    found.bars[1].length_mm += by_mm;
    EXPECT_THAT(TestBars(found).fault, HasSubstr("901-902 and 903-904 contradict"));
  }
}

// Given one of several bars wrong by mm or by a factor, more than can be detected, it is named.
TEST(ScaleBars, TheOneOfSeveralThatIsWrongIsLeftOutByName) {
  for (const std::size_t count : {3U, 4U, 7U}) {
    for (std::size_t wrong = 0; wrong < count; ++wrong) {
      for (const double by_mm : {-900.0, -12.0, -0.5, 0.5, 1.0, 100.0, 24400.0}) {
        FoundBars found = BarsOf(std::vector<double>(count, 1000), 0.01, 0.01);
        found.bars[wrong].length_mm += by_mm;
        const BarScale scale = TestBars(found);
        EXPECT_EQ(scale.fault, "") << count << " " << wrong << " " << by_mm;
        ASSERT_EQ(scale.notices.size(), 1U);
        EXPECT_THAT(scale.notices[0], HasSubstr(found.bars[wrong].from));
        EXPECT_THAT(scale.notices[0], HasSubstr(by_mm > 0 ? "longer" : "shorter"));
        EXPECT_FALSE(scale.bars[wrong].used);
        EXPECT_NEAR(scale.bars[wrong].misclosure_mm, -by_mm, 1e-6 * std::abs(by_mm));
        EXPECT_NEAR(scale.scale, 100, 1e-9);
      }
    }
  }
}

TEST(ScaleBars, TwoWrongOfFourAreAFaultThatNamesTheWorst) {
  FoundBars found = BarsOf({1000, 1000, 1000, 1000}, 1, 0.01);
  found.bars[1].length_mm += 0.5;
  found.bars[3].length_mm -= 2;
  const BarScale scale = TestBars(found);
  EXPECT_THAT(scale.fault, HasSubstr("907-908 is 2."));
  EXPECT_THAT(scale.fault, HasSubstr("others still do"));
}

TEST(ScaleBars, WhatSeveralExplainIsAFaultThatNamesThem) {
  // The first agrees with each of the other two, these not with one another.
  FoundBars found = BarsOf({1000, 1000, 1000}, 1, 0.01);
  found.bars[1].length_mm += 0.045;
  found.bars[2].length_mm -= 0.045;
  const BarScale scale = TestBars(found);
  EXPECT_THAT(scale.fault, HasSubstr("any one of 903-904, 905-906 may be the wrong one"));
}

// Shared ends: what one end is off by is no scale.
TEST(ScaleBars, TestsAreNormalWhereTheCovarianceIsTheErrors) {
  const std::uint64_t seed = 71;
  Random random(seed);
  constexpr int kRepeats = 4000;
  int faults = 0;
  double squares = 0;
  FoundBars sound = BarsOf({1000, 800, 1200, 600}, 1, 0.01);
  Eigen::MatrixXd root = Eigen::MatrixXd::Zero(4, 4);
  for (Eigen::Index i = 0; i < 4; ++i) {
    for (Eigen::Index k = 0; k <= i; ++k) root(i, k) = 1e-5 * (i == k ? 2 : 1.5);
  }
  sound.covariance = root * root.transpose();
  for (int repeat = 0; repeat < kRepeats; ++repeat) {
    FoundBars found = sound;
    Eigen::VectorXd error(4);
    for (double& value : error) value = random.Normal();
    error = root * error;
    for (Eigen::Index i = 0; i < 4; ++i) {
      found.lengths[i] *= std::exp(error[i]);
      ScaleBar& bar = found.bars[static_cast<std::size_t>(i)];
      bar.length_mm += bar.sigma_mm * random.Normal();
    }
    const BarScale scale = TestBars(found);
    for (const BarTest& bar : scale.bars) squares += bar.test * bar.test / 4;
    faults += scale.fault.empty() && scale.notices.empty() ? 0 : 1;
  }
  EXPECT_NEAR(squares / kRepeats, 1, 0.06) << "seed " << seed;  // 4 sigmas
  EXPECT_LE(faults, 4 * kRepeats / 1000 + 14) << "seed " << seed;
}

}  // namespace
}  // namespace trammel::part_alignment
