#include "part_alignment/targets/quieten.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "base/random.h"

namespace trammel::part_alignment {
namespace {

Page Noise(int width, int height, double sigma, Random& random) {
  Page page;
  page.width = width;
  page.height = height;
  for (int i = 0; i < width * height; ++i) {
    page.samples.push_back(
        static_cast<std::uint8_t>(std::clamp(std::lround(random.Normal(120, sigma)), 0L, 255L)));
  }
  return page;
}

double Scatter(const std::uint8_t* first, std::size_t count) {
  double sum = 0;
  double squares = 0;
  for (std::size_t i = 0; i < count; ++i) {
    sum += first[i];
    squares += first[i] * first[i];
  }
  const double mean = sum / static_cast<double>(count);
  return std::sqrt(squares / static_cast<double>(count) - mean * mean);
}

// 16 rows of 160 differences: their median is known to 3.5 %. Rounding to grey levels adds 1/12 of
// variance.
TEST(PixelNoise, IsWithinATenthOfWhatWasAdded) {
  Random random(2);
  for (const double sigma : {0.7, 1.0, 2.0, 3.3, 6.0}) {
    const Page page = Noise(640, 480, sigma, random);
    EXPECT_NEAR(PixelNoise(page.view()), std::hypot(sigma, 0.29), 0.1 * sigma + 0.05) << sigma;
  }
}

TEST(PixelNoise, OfAPictureOfOneShadeIsNone) {
  Random random(2);
  EXPECT_EQ(PixelNoise(Noise(64, 48, 0, random).view()), 0);
}

TEST(Quieten, LeavesThreeEighthsOfWhiteNoise) {
  Random random(3);
  const Page page = Noise(401, 300, 8, random);
  std::vector<std::uint8_t> quiet;
  Quieten(page.view(), quiet);
  ASSERT_EQ(quiet.size(), page.samples.size());
  // Rounding adds 1/12 of variance.
  EXPECT_NEAR(Scatter(quiet.data(), quiet.size()), 8 * 0.375, 0.2);
}

TEST(Quieten, MovesNothing) {
  Page page;
  page.width = 20;
  page.height = 18;
  page.samples.assign(20 * 18, 10);
  page.row(7)[11] = 210;
  std::vector<std::uint8_t> quiet;
  Quieten(page.view(), quiet);
  const auto at = [&](int x, int y) { return quiet[static_cast<std::size_t>(y * 20 + x)]; };
  EXPECT_NEAR(at(11, 7), 60, 1);
  EXPECT_EQ(at(10, 7), at(12, 7));
  EXPECT_EQ(at(11, 6), at(11, 8));
  EXPECT_EQ(at(10, 6), at(12, 8));
  EXPECT_EQ(at(0, 0), 10);
  EXPECT_EQ(at(19, 17), 10);
}

}  // namespace
}  // namespace trammel::part_alignment
