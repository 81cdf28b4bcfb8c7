#include "vision/still_picture.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "base/random.h"

namespace trammel::vision {
namespace {

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
    for (int x = 0; x < 300; ++x) {  // of the ground left of the stripe, all three colours
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
