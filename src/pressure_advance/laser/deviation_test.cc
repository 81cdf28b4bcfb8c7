#include "pressure_advance/laser/deviation.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <numeric>
#include <opencv2/core.hpp>
#include <opencv2/imgcodecs.hpp>
#include <string>

#include "support/sweep_world.h"

namespace trammel::pressure_advance {
namespace {

TEST(Deviation, WeightsAPixelByItsTenthPower) {
  // One row of two lit pixels, 100 and 200, far apart: the blur keeps their ratio.
  Frame frame(20, 1);
  for (const auto& [x, level] : {std::pair{5, 100}, std::pair{14, 200}}) {
    std::fill_n(frame.row(0) + 3 * x, 3, static_cast<std::uint8_t>(level));
  }
  DeviationFrame result;
  FilterFrame(frame.view(), result);
  const double ratio = std::pow(0.5, 10);
  constexpr double kRounding_px = 0.005;  // of blurred grey levels
  EXPECT_NEAR(result.centre_px[0], (14 + 5 * ratio) / (1 + ratio), kRounding_px);
}

TEST(Deviation, RowsWithoutLaserAreLeftOutRatherThanConstant) {
  HeightMap map;
  map.frames = 4;
  map.rows = 3;
  map.height_px = {1, 5, 0, 3, 5, 9, 1, 5, 0, 3, 5, 0};
  map.sigma_px = {1, 1, 0, 1, 1, 1, 1, 1, 0, 1, 1, 0};
  // Rows 0 and 1 deviate by 1 and 0; row 2 is seen once in four frames; 3 rows from 2.
  ASSERT_TRUE(DeviationScore(map).has_value());
  EXPECT_NEAR(*DeviationScore(map), 1.5, 1e-6);
  std::fill(map.sigma_px.begin(), map.sigma_px.end(), 0.0F);
  EXPECT_FALSE(DeviationScore(map).has_value());
}

TEST(Deviation, CubicIsExactOnACubic) {
  const auto cubic = [](double p) { return 90 - 4000 * p + 60000 * p * p - 100000 * p * p * p; };
  std::vector<double> p;
  std::vector<std::optional<double>> score;
  for (int i = 0; i < 10; ++i) {
    p.push_back(0.06 * i / 9);
    score.emplace_back(cubic(p.back()));
  }
  score[3].reset();
  const DeviationResult result = ScoreByDeviation(p, score);
  ASSERT_EQ(result.cubic.size(), 4U);
  EXPECT_NEAR(result.cubic[0], 90, 1e-8);
  EXPECT_NEAR(result.cubic[1], -4000, 1e-5);
  EXPECT_NEAR(result.cubic[2], 60000, 1e-3);
  EXPECT_NEAR(result.cubic[3], -100000, 1e-2);
  EXPECT_NEAR(*result.r_squared, 1, 1e-12);
  // 3e5 p^2 - 1.2e5 p + 4e3 = 0
  EXPECT_NEAR(*result.cubic_minimum_s, (1.2e5 - std::sqrt(1.44e10 - 4.8e9)) / 6e5, 1e-9);
  EXPECT_EQ(result.best_s, p[6]);  // 0.04; the minimum lies at 0.0367, p[5] is 0.0333
}

TEST(RecordedFrames, FilteringMatchesTheAuthorsOwnPicture) {
  const char* data = std::getenv("TRAMMEL_TEST_DATA");
  if (data == nullptr) {
    GTEST_SKIP() << "set TRAMMEL_TEST_DATA to the folder with laser/processed.png";
  }
  const std::string folder = std::string(data) + "/laser/";
  const cv::Mat raw = cv::imread(folder + "cropped.png", cv::IMREAD_COLOR);
  const cv::Mat processed = cv::imread(folder + "processed.png", cv::IMREAD_GRAYSCALE);
  ASSERT_FALSE(raw.empty() || processed.empty()) << folder;
  DeviationFrame result;
  const BgrView view{raw.data, raw.cols, raw.rows, static_cast<std::ptrdiff_t>(raw.step)};
  FilterFrame(view, result);
  int differing = 0;
  for (int y = 0; y < raw.rows; ++y) {
    for (int x = 0; x < raw.cols; ++x) {
      const auto i = static_cast<std::size_t>(y * raw.cols + x);
      differing += std::abs(int{result.grey[i]} - int{processed.at<std::uint8_t>(y, x)}) > 1;
    }
  }
  // The published picture shows the frame masked and grey, before the blur.
  EXPECT_EQ(differing, 0);
}

}  // namespace
}  // namespace trammel::pressure_advance
