// Patterns of one plate, found by their places, in drawn pictures.
#include "pressure_advance/photo/plate_patterns.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <cstdint>
#include <opencv2/core.hpp>
#include <opencv2/imgproc.hpp>
#include <vector>

#include "base/random.h"

namespace trammel::pressure_advance {
namespace {

using ::testing::HasSubstr;

constexpr int kWidth_px = 1360, kHeight_px = 1000;
constexpr double kScale_px_mm = 5;
constexpr double kSpacing_mm = 4;

std::vector<PlatePattern> Grid(int columns, int rows, double column_mm, double row_mm) {
  std::vector<PlatePattern> patterns;
  for (int row = 0; row < rows; ++row) {
    for (int column = 0; column < columns; ++column) {
      patterns.push_back({10, kSpacing_mm, column_mm * column, row_mm * row, 0});
    }
  }
  return patterns;
}

// Bed (mm, from the grid's middle) to picture: turned and seen at a slant.
cv::Matx33d Camera() {
  constexpr double kTurn_rad = 0.3, kScale = kScale_px_mm, kTilt = 2e-4;
  const double c = kScale * std::cos(kTurn_rad), s = kScale * std::sin(kTurn_rad);
  const double x = kWidth_px / 2.0, y = kHeight_px / 2.0;
  return {c + x * kTilt, s, x, s + y * kTilt, -c, y, kTilt, 0, 1};
}

// Draws chevrons and frames; a pattern `hidden` is left out.
cv::Mat Draw(const std::vector<PlatePattern>& patterns, std::size_t hidden) {
  cv::Mat picture(kHeight_px, kWidth_px, CV_8UC3, cv::Scalar(80, 80, 80));
  const double x = patterns.back().x_mm / 2, y = patterns.back().y_mm / 2;
  const cv::Matx33d camera = Camera();
  const auto stroke = [&](const PlatePattern& p, cv::Point2d a, cv::Point2d b, double width_mm) {
    constexpr int kSteps = 40, kShift = 4;
    const auto at = [&](double part) {
      const cv::Point2d mm = a + part * (b - a);
      const cv::Vec3d v = camera * cv::Vec3d(p.x_mm + mm.x - x, p.y_mm + mm.y - y, 1);
      return cv::Point(cvRound(16 * v[0] / v[2]), cvRound(16 * v[1] / v[2]));
    };
    for (int i = 0; i < kSteps; ++i) {
      cv::line(picture, at(double(i) / kSteps), at((i + 1.0) / kSteps), cv::Scalar(190, 190, 190),
               cvRound(kScale_px_mm * width_mm), cv::LINE_AA, kShift);
    }
  };
  for (std::size_t k = 0; k < patterns.size(); ++k) {
    if (k == hidden) continue;
    const PlatePattern& p = patterns[k];
    const double middle = (p.count - 1) / 2.0 * kSpacing_mm, arm = 21.2;
    for (int i = 0; i < p.count; ++i) {
      const cv::Point2d apex(i * kSpacing_mm - middle, 0);
      stroke(p, apex + cv::Point2d(-arm, arm), apex, 1.4);
      stroke(p, apex + cv::Point2d(-arm, -arm), apex, 1.4);
    }
    const cv::Point2d low(-middle - arm - 2, -arm), high(middle + 1.5, arm);
    for (const double edge : {low.y, high.y}) stroke(p, {low.x, edge}, {high.x, edge}, 1.7);
    for (const double edge : {low.x, high.x}) stroke(p, {edge, low.y}, {edge, high.y}, 1.7);
  }
  Random random(5);
  for (int row = 0; row < picture.rows; ++row) {
    auto* value = picture.ptr<std::uint8_t>(row);
    for (int i = 0; i < 3 * picture.cols; ++i) {
      value[i] = cv::saturate_cast<std::uint8_t>(value[i] + 6 * random.Normal());
    }
  }
  return picture;
}

PlateView Find(const std::vector<PlatePattern>& patterns, std::size_t hidden) {
  const cv::Mat picture = Draw(patterns, hidden);
  return FindPlatePatterns(
      {picture.data, picture.cols, picture.rows, static_cast<std::ptrdiff_t>(picture.step)},
      patterns);
}

TEST(PlatePatterns, AreFoundByTheirPlacesAndOneThatIsNotSeenIsAbsent) {
  const auto patterns = Grid(3, 2, 75, 60);
  constexpr std::size_t kHidden = 4;
  const PlateView plate = Find(patterns, kHidden);
  ASSERT_EQ(plate.problem, "");
  ASSERT_EQ(plate.found.size(), 6U);
  for (std::size_t i = 0; i < 6; ++i) {
    ASSERT_EQ(plate.found[i].has_value(), i != kHidden) << i;
    if (!plate.found[i]) continue;
    const vision::PointPx at = plate.found[i]->photo_from_plane({0, 0});
    const cv::Vec3d v = Camera() * cv::Vec3d(patterns[i].x_mm - 75 - 18, patterns[i].y_mm - 30, 1);
    EXPECT_NEAR(at.x, v[0] / v[2], 5) << i;
    EXPECT_NEAR(at.y, v[1] / v[2], 5) << i;
  }
}

// A phone's lens bends the plate: a place continued from another pattern cuts off an arm's end.
TEST(PlatePatterns, OneThatLiesBesideItsPlaceIsFound) {
  const auto patterns = Grid(3, 2, 75, 60);
  const cv::Mat picture = Draw(patterns, 99);
  auto places = patterns;
  places[0].y_mm -= 3.5 * kSpacing_mm;
  const PlateView plate = FindPlatePatterns(
      {picture.data, picture.cols, picture.rows, static_cast<std::ptrdiff_t>(picture.step)},
      places);
  ASSERT_EQ(plate.problem, "");
  for (std::size_t i = 0; i < 6; ++i) EXPECT_TRUE(plate.found[i].has_value()) << i;
}

// Part of the photo that holds one pattern holds its neighbours' arms, which bend its plane.
TEST(PlatePatterns, OnesThatLieCloseTogetherAreFound) {
  const PlateView plate = Find(Grid(3, 3, 62, 46), 99);
  ASSERT_EQ(plate.problem, "");
  for (std::size_t i = 0; i < 9; ++i) EXPECT_TRUE(plate.found[i].has_value()) << i;
}

TEST(PlatePatterns, AnOrderThatDoesNotFitIsRefused) {
  const auto patterns = Grid(3, 2, 75, 60);
  auto other = Grid(6, 1, 75, 60);
  const cv::Mat picture = Draw(patterns, 99);
  const BgrView view{picture.data, picture.cols, picture.rows,
                     static_cast<std::ptrdiff_t>(picture.step)};
  EXPECT_THAT(FindPlatePatterns(view, other).problem, HasSubstr("is it the file"));
  // Two of three columns fit two orders.
  auto more = patterns;
  for (const double y : {0.0, 60.0}) more.push_back({10, kSpacing_mm, 225, y, 0});
  EXPECT_THAT(FindPlatePatterns(view, more).problem, HasSubstr("more than one order"));
  const cv::Mat plate(kHeight_px, kWidth_px, CV_8UC3, cv::Scalar(80, 80, 80));
  EXPECT_THAT(
      FindPlatePatterns(
          {plate.data, plate.cols, plate.rows, static_cast<std::ptrdiff_t>(plate.step)}, patterns)
          .problem,
      HasSubstr("no pattern of corners is seen"));
}

}  // namespace
}  // namespace trammel::pressure_advance
