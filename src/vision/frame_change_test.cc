#include "vision/frame_change.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstring>
#include <opencv2/core.hpp>
#include <opencv2/imgcodecs.hpp>
#include <string>

#include "base/random.h"
#include "support/test_pictures.h"

namespace trammel::vision {
namespace {

constexpr int kWidth = 160;
constexpr int kHeight = 120;

/// A dark picture with a speckled line across, seen where the head is; `place` moves the speckle
/// on.
Frame LaserPicture(double place, double noise, double gain, Random& random) {
  Frame frame(kWidth, kHeight);
  for (int y = 0; y < kHeight; ++y) {
    for (int x = 0; x < kWidth; ++x) {
      const double across = (x - 80.0) / 2.5;
      const double speckle =
          1 + 0.5 * std::sin(0.9 * y + 40 * place) * std::cos(0.37 * y - 25 * place);
      const double light = 8 + 150 * std::exp(-0.5 * across * across) * speckle;
      for (int c = 0; c < 3; ++c) {
        const double value = gain * light * (c == 2 ? 1.0 : 0.3) + noise * random.Normal();
        frame.row(y)[3 * x + c] = static_cast<std::uint8_t>(std::clamp(value, 0.0, 255.0));
      }
    }
  }
  const std::string jpeg = test::JpegOf(frame, 80);
  const cv::Mat bytes(1, static_cast<int>(jpeg.size()), CV_8UC1, const_cast<char*>(jpeg.data()));
  const cv::Mat decoded = cv::imdecode(bytes, cv::IMREAD_COLOR);
  std::memcpy(frame.bgr.data(), decoded.data, frame.bgr.size());
  return frame;
}

double Change(const Frame& a, const Frame& b) {
  FrameSketch before;
  FrameSketch after;
  std::vector<float> scratch;
  SketchFrame(a.view(), before);
  SketchFrame(b.view(), after);
  return FrameChange(before, after, scratch);
}

TEST(FrameChange, IsZeroForTheSamePicture) {
  Random random(1);
  const Frame frame = LaserPicture(0, 3, 1, random);
  EXPECT_EQ(Change(frame, frame), 0);
  const Frame black(64, 48);
  EXPECT_EQ(Change(black, black), 0);
}

TEST(FrameChange, TellsMovingFromStandingThroughNoiseAndJpeg) {
  for (std::uint64_t seed = 1; seed <= 20; ++seed) {
    Random random(seed);
    const Frame first = LaserPicture(0, 6, 1, random);
    const double standing = Change(first, LaserPicture(0, 6, 1, random));
    const double moving = Change(first, LaserPicture(0.05, 6, 1, random));
    EXPECT_GT(moving, 3 * standing) << "seed " << seed;
  }
}

TEST(FrameChange, ACommonChangeOfExposureIsNoMotion) {
  Random random(1);
  const Frame first = LaserPicture(0, 3, 1, random);
  const double moving = Change(first, LaserPicture(0.05, 3, 1, random));
  for (const double gain : {0.85, 1.1}) {
    EXPECT_LT(Change(first, LaserPicture(0, 3, gain, random)), 0.35 * moving) << gain;
  }
}

/// A grey scene with a stripe three pixels wide that begins at `column`, under noise.
Frame Stripe(int column, double noise, Random& random) {
  Frame frame(320, 60);
  for (int y = 0; y < frame.height; ++y) {
    for (int x = 0; x < frame.width; ++x) {
      const double level = x >= column && x < column + 3 ? 180 : 40;
      for (int c = 0; c < 3; ++c) {
        const double value = std::round(level + noise * random.Normal());
        frame.row(y)[3 * x + c] = static_cast<std::uint8_t>(std::clamp(value, 0.0, 255.0));
      }
    }
  }
  return frame;
}

TEST(StillPicture, MeanHasHalfOfTheNoiseOfAFrame) {
  Random random(1);
  StillPicture picture;
  for (int i = 0; i < 4; ++i) {
    ASSERT_EQ(picture.Add(Stripe(100, 4, random)), StillPicture::Added::kStill);
  }
  const Frame mean = picture.Mean();
  const BgrView view = mean.view();
  double squares = 0;
  int count = 0;
  for (int y = 0; y < mean.height; ++y) {
    for (int x = 0; x < 300; ++x) {  // ground left of the stripe, all three colours
      squares += std::pow(view.row(y)[x] - 40.0, 2);
      ++count;
    }
  }
  const double sd = std::sqrt(squares / count);
  EXPECT_GT(sd, 1.8);  // 2, and what rounding adds
  EXPECT_LT(sd, 2.2);
}

TEST(StillPicture, AStripeThatMovedByItsWidthIsNotAddedToTheMean) {
  Random random(2);
  StillPicture picture;
  ASSERT_EQ(picture.Add(Stripe(100, 4, random)), StillPicture::Added::kStill);
  EXPECT_EQ(picture.Add(Stripe(103, 4, random)), StillPicture::Added::kMoved);
  EXPECT_EQ(picture.frames(), 1);
  EXPECT_NEAR(picture.Mean().view().row(7)[3 * 104], 40, 24);
}

TEST(StillPicture, AFrameOfAnotherSizeIsNamed) {
  StillPicture picture;
  ASSERT_EQ(picture.Add(Frame(8, 6)), StillPicture::Added::kStill);
  EXPECT_EQ(picture.Add(Frame(6, 8)), StillPicture::Added::kOtherSize);
}

TEST(StillPicture, TheMeanRoundsToTheNearestLevel) {
  StillPicture picture;
  for (const int level : {10, 10, 11, 11}) {
    Frame frame(2, 2);
    std::fill(frame.bgr.begin(), frame.bgr.end(), static_cast<std::uint8_t>(level));
    frame.time_s = level;
    ASSERT_EQ(picture.Add(frame), StillPicture::Added::kStill);
  }
  EXPECT_EQ(picture.Mean().bgr.front(), 11);
  EXPECT_EQ(picture.Mean().time_s, 10);
}

}  // namespace
}  // namespace trammel::vision
