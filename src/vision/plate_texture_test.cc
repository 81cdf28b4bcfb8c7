// Grey pictures of smooth lines on a textured plate of the same brightness.
#include "vision/plate_texture.h"

#include <gtest/gtest.h>

#include <opencv2/core.hpp>
#include <opencv2/imgproc.hpp>

namespace trammel::vision {
namespace {

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
