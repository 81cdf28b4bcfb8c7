#include "pressure_advance/photo/photo_mark.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <opencv2/core.hpp>
#include <opencv2/imgproc.hpp>
#include <string>
#include <utility>
#include <vector>

#include "base/random.h"
#include "base/statistics.h"
#include "pressure_advance/photo/photo_reader.h"
#include "pressure_advance/photo/photo_test_support.h"

namespace trammel::pressure_advance {
namespace {

using ::testing::Contains;
using ::testing::HasSubstr;
using ::testing::Not;

// Slow ends of one length: the lines cannot tell a turn by 180 degrees from the order of the list.
DrawnPhoto Symmetric() {
  DrawnPhoto photo = Usual();
  photo.slow_before = photo.slow_after = 0.25;
  photo.corner_mark = true;
  return photo;
}

// Each of the eight ways in which a square picture can be turned and mirrored.
std::vector<cv::Mat> AllWays(const cv::Mat& picture) {
  std::vector<cv::Mat> ways;
  for (const bool mirrored : {false, true}) {
    cv::Mat way = picture.clone();
    if (mirrored) cv::flip(picture, way, 1);
    for (int turns = 0; turns < 4; ++turns) {
      ways.push_back(way.clone());
      cv::rotate(way, way, cv::ROTATE_90_CLOCKWISE);
    }
  }
  return ways;
}

TEST(PhotoMark, SettlesEveryTurnAndMirrorOfASymmetricPattern) {
  const DrawnPhoto drawn = Symmetric();
  for (const cv::Mat& way : AllWays(ToMat(Draw(drawn)))) {
    const PhotoMeasurement measured = MeasurePhoto(View(way), OptionsFor(drawn));
    ASSERT_EQ(measured.refusal, "");
    ASSERT_EQ(measured.profiles.size(), drawn.pressure_advance_s.size());
    EXPECT_THAT(measured.notices, Contains(HasSubstr("the printed mark says")));
    // The first line, of too low a PA, is starved where it accelerates, the last one swells.
    EXPECT_LT(Relative(measured.profiles.front(), 0.22, 0.28), 0.95);
    EXPECT_GT(Relative(measured.profiles.back(), 0.22, 0.28), 1.05);
  }
}

// Any light, lens, plate and bead that leaves lines to be read.
DrawnPhoto AnyPhoto(std::uint64_t seed) {
  Random random(seed);
  DrawnPhoto drawn = Symmetric();
  drawn.seed = seed;
  drawn.darker = random.Uniform() < 0.5;
  drawn.contrast = 25 + 95 * random.Uniform();
  drawn.noise = 1 + 14 * random.Uniform();
  drawn.grain = 4 + 26 * random.Uniform();
  drawn.blur_px = 0.3 + 2 * random.Uniform();
  drawn.unevenness = 0.9 * random.Uniform();
  drawn.bead_mm = 0.8 + random.Uniform();
  drawn.tilt = 0.25 * random.Uniform();
  return drawn;
}

// A blob of plastic, or a lamp's reflection, on the plate between an outer line and its bar.
void AddBlob(const DrawnPhoto& drawn, Random& random, cv::Mat& image) {
  const double radius_px = (0.5 + random.Uniform()) * drawn.px_per_mm;
  const double x = image.cols * (0.15 + 0.7 * random.Uniform());
  const double y = image.rows * (random.Uniform() < 0.5 ? 0.1 : 0.9);
  const int level = drawn.darker ? 20 : 235;
  cv::circle(image, cv::Point2d(x, y), static_cast<int>(radius_px), cv::Scalar::all(level), -1,
             cv::LINE_AA);
}

TEST(PhotoMark, IsNotSeenWhereThereIsNone) {
  int read = 0;
  for (std::uint64_t seed = 7042; seed < 7062; ++seed) {
    DrawnPhoto drawn = AnyPhoto(seed);
    drawn.corner_mark = false;
    cv::Mat image = ToMat(Draw(drawn));
    Random random(seed);
    if (seed % 2 == 1) AddBlob(drawn, random, image);
    PhotoOptions options = OptionsFor(drawn);
    options.corner_mark = true;
    const PhotoMeasurement measured = MeasurePhoto(View(image), options);
    read += measured.refusal.empty() ? 1 : 0;
    for (const std::string& notice : measured.notices) {
      EXPECT_THAT(notice, Not(HasSubstr("the printed mark says"))) << seed;
    }
  }
  EXPECT_GT(read, 10) << "photos that are refused show nothing";
}

TEST(PhotoMark, IsNeverSeenInAnotherCorner) {
  int seen = 0;
  for (std::uint64_t seed = 7100; seed < 7110; ++seed) {
    const DrawnPhoto drawn = AnyPhoto(seed);
    cv::Mat mirrored;
    cv::flip(ToMat(Draw(drawn)), mirrored, 1);
    Random random(seed);
    if (seed % 2 == 1) AddBlob(drawn, random, mirrored);
    const PhotoMeasurement measured = MeasurePhoto(View(mirrored), OptionsFor(drawn));
    for (const std::string& notice : measured.notices) {
      if (notice.find("the printed mark says") == std::string::npos) continue;
      ++seen;
      EXPECT_THAT(notice, HasSubstr("the lines start at the right")) << seed;
      EXPECT_THAT(notice, HasSubstr("bottom")) << seed;
    }
  }
  EXPECT_GT(seen, 4);
}

TEST(PhotoMark, ASideThatContradictsTheLinesIsRefused) {
  DrawnPhoto drawn = Symmetric();
  drawn.corner_mark = false;
  drawn.slow_before = 0.1;
  drawn.slow_after = 0.3;
  PhotoOptions options = OptionsFor(drawn);
  options.corner_mark = false;
  options.start = PhotoSide::kRight;
  EXPECT_THAT(MeasurePhoto(View(ToMat(Draw(drawn))), options).refusal, HasSubstr("the other end"));
  options.start = PhotoSide::kLeft;
  EXPECT_EQ(MeasurePhoto(View(ToMat(Draw(drawn))), options).refusal, "");
}

cv::Mat Cropped(const cv::Mat& picture, int left, int top, int right, int bottom) {
  return picture(cv::Rect(left, top, picture.cols - left - right, picture.rows - top - bottom))
      .clone();
}

// The drawn lines end 65 px from the picture's left and right, the outer ones lie 114 px from its
// top and bottom; the frame's bars lie 13 px and 39 px outside of them.
TEST(PhotoComb, ReadsLinesWhoseFrameLeavesThePhoto) {
  const DrawnPhoto drawn = Usual();
  const cv::Mat upright = ToMat(Draw(drawn));
  const PhotoMeasurement reference = MeasurePhoto(View(upright), OptionsFor(drawn));
  ASSERT_EQ(reference.refusal, "");
  const auto compare = [&](const cv::Mat& picture, const char* what) {
    const PhotoMeasurement measured = MeasurePhoto(View(picture), OptionsFor(drawn));
    ASSERT_EQ(measured.refusal, "") << what;
    ASSERT_EQ(measured.profiles.size(), reference.profiles.size()) << what;
    EXPECT_EQ(measured.first_line, PhotoSide::kBottom) << what;
    ASSERT_TRUE(measured.segments.has_value()) << what;
    EXPECT_NEAR(measured.segments->fast_begin, 0.1, 0.03) << what;
    EXPECT_NEAR(measured.segments->fast_end, 0.7, 0.03) << what;
    EXPECT_LT(Difference(reference, measured), 0.05) << what;
  };
  compare(Cropped(upright, 0, 0, 75, 0), "right");
  compare(Cropped(upright, 0, 0, 130, 0), "right, a sixth of the lines");
  compare(Cropped(upright, 70, 0, 0, 0), "left");
  compare(Cropped(upright, 0, 0, 0, 85), "bottom");
  compare(Cropped(upright, 0, 85, 0, 0), "top");
  compare(Cropped(upright, 0, 85, 80, 85), "all but the left");
  cv::Mat turned;
  const cv::Mat turn =
      cv::getRotationMatrix2D(cv::Point2d(upright.cols / 2.0, upright.rows / 2.0), 25, 1);
  cv::warpAffine(upright, turned, turn, upright.size(), cv::INTER_LINEAR, cv::BORDER_REPLICATE);
  compare(turned, "turned, corners cut off");
}

// The photo ends on the third line from the bottom, and shows the frame close at the top.
TEST(PhotoComb, CountsLinesFromWhereTheFrameCloses) {
  const DrawnPhoto drawn = Usual();
  const cv::Mat cropped = Cropped(ToMat(Draw(drawn)), 0, 0, 0, 165);
  cv::Mat upside_down;
  cv::rotate(cropped, upside_down, cv::ROTATE_180);
  for (const cv::Mat& picture : {cropped, upside_down}) {
    const PhotoMeasurement measured = MeasurePhoto(View(picture), OptionsFor(drawn));
    ASSERT_EQ(measured.refusal, "");
    const std::size_t lost = drawn.pressure_advance_s.size() - measured.profiles.size();
    EXPECT_EQ(lost, 3U);
    for (std::size_t i = 0; i < measured.profiles.size(); ++i) {
      EXPECT_EQ(measured.profiles[i].pressure_advance_s, drawn.pressure_advance_s[i + lost]);
    }
    EXPECT_THAT(measured.notices, ::testing::Contains(HasSubstr("where the frame closes")));
  }
}

// An apparent bar of the frame may be a smear or a line: it is a bar only if rails end there.
TEST(PhotoComb, CountsNoLinesFromABarBehindWhichThePhotoEndsOrTheRailsGoOn) {
  const DrawnPhoto drawn = Usual();
  const cv::Mat upright = ToMat(Draw(drawn));
  const cv::Mat cut = Cropped(upright, 0, 80, 0, 165);
  EXPECT_NE(MeasurePhoto(View(cut), OptionsFor(drawn)).refusal, "");
  DrawnPhoto straight = drawn;
  straight.roll_rad = straight.tilt = straight.bow = 0;
  cv::Mat longer = Cropped(ToMat(Draw(straight)), 0, 0, 0, 165);
  EXPECT_EQ(MeasurePhoto(View(longer), OptionsFor(drawn)).refusal, "");
  // The bar lies in the rows 62 … 75, below them plate and the two rails.
  for (int y = 52; y >= 0; y -= 10) {
    longer(cv::Rect(0, 85, longer.cols, 10)).copyTo(longer(cv::Rect(0, y, longer.cols, 10)));
  }
  EXPECT_NE(MeasurePhoto(View(longer), OptionsFor(drawn)).refusal, "");
}

// A print whose list is shifted by one value gives the same picture: nothing in it tells which of
// the lines these are.
TEST(PhotoComb, RefusesLinesWhoseNeighboursAreCutOffAtBothSides) {
  const DrawnPhoto drawn = Usual();
  DrawnPhoto shifted = drawn;
  const double step_s = drawn.pressure_advance_s[1] - drawn.pressure_advance_s[0];
  for (double& value : shifted.pressure_advance_s) value += step_s;
  shifted.right_value_s += step_s;
  const cv::Mat picture = Cropped(ToMat(Draw(drawn)), 0, 165, 0, 165);
  EXPECT_EQ(cv::norm(picture, Cropped(ToMat(Draw(shifted)), 0, 165, 0, 165), cv::NORM_INF), 0);
  EXPECT_THAT(MeasurePhoto(View(picture), OptionsFor(drawn)).refusal,
              HasSubstr("shifted by a line would look the same"));
}

}  // namespace
}  // namespace trammel::pressure_advance
