#include "vision/image.h"

#include <gtest/gtest.h>

#include <cmath>
#include <opencv2/core.hpp>
#include <opencv2/imgproc.hpp>

#include "base/random.h"
#include "vision/filament_contrast.h"

namespace trammel::vision {
namespace {

// Eight equations of coordinates up to 1000 px in doubles lose about 1e-16 * 1000^2 = 1e-10 px to
// rounding, and as much again to the condition of a well-shaped quad, some 100.
constexpr double kRounding_px = 1e-7;

constexpr Quad kSquare = {{{0, 0}, {100, 0}, {100, 100}, {0, 100}}};

Quad Tilted(Random& random) {
  Quad quad = {{{100, 80}, {900, 120}, {850, 700}, {150, 650}}};
  for (PointPx& corner : quad) {
    corner.x += random.Uniform(-60, 60);
    corner.y += random.Uniform(-60, 60);
  }
  return quad;
}

TEST(Homography, TakesEachCornerToItsOwn) {
  Random random(11);
  for (int trial = 0; trial < 100; ++trial) {
    const Quad target = Tilted(random);
    const auto map = TargetFromSource(target, kSquare);
    ASSERT_TRUE(map) << "seed 11, trial " << trial;
    for (std::size_t i = 0; i < 4; ++i) {
      EXPECT_LT(Distance_px((*map)(kSquare[i]), target[i]), kRounding_px)
          << "seed 11, trial " << trial;
    }
  }
}

// Unlike an affine map, it maps the diagonals' crossing to the diagonals' crossing.
TEST(Homography, KeepsStraightLinesStraight) {
  Random random(13);
  const Quad t = Tilted(random);
  const auto map = TargetFromSource(t, kSquare);
  ASSERT_TRUE(map);
  const PointPx centre = (*map)({50, 50});
  const auto off_line = [&](const PointPx& a, const PointPx& b) {
    return std::abs((b.x - a.x) * (centre.y - a.y) - (b.y - a.y) * (centre.x - a.x)) /
           Distance_px(a, b);
  };
  EXPECT_LT(off_line(t[0], t[2]), kRounding_px);
  EXPECT_LT(off_line(t[1], t[3]), kRounding_px);
}

TEST(Homography, RefusesThreeCornersOnOneLine) {
  const Quad flat = {{{0, 0}, {50, 0}, {100, 0}, {0, 100}}};
  const Quad point = {{{5, 5}, {5, 5}, {5, 5}, {5, 5}}};
  for (const Quad& bad : {flat, point}) {
    EXPECT_FALSE(TargetFromSource(bad, kSquare));
    EXPECT_FALSE(TargetFromSource(kSquare, bad));
  }
}

TEST(Quads, KnowTheirAreaAndWhetherTheyAreConvex) {
  EXPECT_DOUBLE_EQ(Area_px2(kSquare), 10000);
  const Quad other_way = {{kSquare[3], kSquare[2], kSquare[1], kSquare[0]}};
  EXPECT_DOUBLE_EQ(Area_px2(other_way), 10000);
  EXPECT_TRUE(IsConvex(kSquare));
  EXPECT_TRUE(IsConvex(other_way));
  EXPECT_FALSE(IsConvex({{{0, 0}, {100, 100}, {100, 0}, {0, 100}}})) << "crosses itself";
  EXPECT_FALSE(IsConvex({{{0, 0}, {100, 0}, {20, 20}, {0, 100}}})) << "has a notch";
}

Frame Grey(const cv::Mat& grey) {
  Frame frame(grey.cols, grey.rows);
  cv::Mat target(grey.rows, grey.cols, CV_8UC3, frame.bgr.data());
  cv::cvtColor(grey, target, cv::COLOR_GRAY2BGR);
  return frame;
}

// A smooth left half beside a grainy right half, both of mean 120.
Frame SmoothBesideGrain() {
  cv::Mat value(200, 400, CV_32F, cv::Scalar(120)), grain(200, 200, CV_32F), grey;
  cv::RNG random(7);
  random.fill(grain, cv::RNG::NORMAL, 0, 15);
  value.colRange(200, 400) += grain;
  value.convertTo(grey, CV_8U);
  return Grey(grey);
}

TEST(PlateTexture, TellsGrainFromSmoothFilamentOfTheSameBrightness) {
  const Frame textured = WithTexture(SmoothBesideGrain().view());
  const cv::Mat bgr(textured.height, textured.width, CV_8UC3,
                    const_cast<std::uint8_t*>(textured.bgr.data()));
  const cv::Scalar smooth = cv::mean(bgr.colRange(10, 190)),
                   grain = cv::mean(bgr.colRange(210, 390));
  EXPECT_NEAR(smooth[0], grain[0], 2);
  for (const int channel : {1, 2}) EXPECT_GT(grain[channel], smooth[channel] + 50) << channel;
}

TEST(PlateTexture, KeepsTheBrightnessAndGivesItBack) {
  const Frame before = SmoothBesideGrain();
  Frame after = WithTexture(before.view());
  EXPECT_FALSE(IsGrey(after.view()));
  DropTexture(after);
  EXPECT_EQ(after.bgr, before.bgr);
}

TEST(PlateTexture, TakesOneColouredPixelForColour) {
  Frame frame = SmoothBesideGrain();
  EXPECT_TRUE(IsGrey(frame.view()));
  frame.row(100)[3 * 50] = 140;
  EXPECT_FALSE(IsGrey(frame.view()));
}

}  // namespace
}  // namespace trammel::vision
