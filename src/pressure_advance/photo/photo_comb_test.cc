// Patterns of which a photo shows a part: lines without their frame, or cut off.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <opencv2/core.hpp>
#include <opencv2/imgproc.hpp>
#include <string>
#include <utility>
#include <vector>

#include "base/statistics.h"
#include "pressure_advance/photo/photo_eye.h"
#include "pressure_advance/photo/photo_test_support.h"

namespace trammel::pressure_advance {
namespace {

using ::testing::HasSubstr;

PhotoOptions OptionsFor(const DrawnPhoto& photo) {
  PhotoOptions options;
  options.pressure_advance_s = photo.pressure_advance_s;
  options.slow_before = photo.slow_before;
  options.slow_after = photo.slow_after;
  return options;
}

DrawnPhoto Usual() {
  DrawnPhoto photo;
  photo.pressure_advance_s = Steps();
  return photo;
}

cv::Mat ToMat(const Frame& frame) {
  return cv::Mat(frame.height, frame.width, CV_8UC3, const_cast<std::uint8_t*>(frame.bgr.data()))
      .clone();
}

BgrView View(const cv::Mat& image) {
  return {image.data, image.cols, image.rows, static_cast<std::ptrdiff_t>(image.step)};
}

double UsualWidth(const LineProfile& profile) {
  std::vector<double> widths;
  for (const ProfileSample& sample : profile.samples) {
    if (sample.width.seen()) widths.push_back(sample.width.value);
  }
  return widths.empty() ? 0 : Median(widths);
}

// Mean width between two positions, over the line's usual width.
double Relative(const LineProfile& profile, double from, double to) {
  std::vector<double> widths;
  for (const ProfileSample& sample : profile.samples) {
    if (sample.width.seen() && sample.position > from && sample.position < to) {
      widths.push_back(sample.width.value);
    }
  }
  return widths.empty() ? -1 : Mean(widths) / UsualWidth(profile);
}

// Largest difference of the lines' relative widths at the deceleration.
double Difference(const PhotoMeasurement& a, const PhotoMeasurement& b) {
  double largest = 0;
  for (std::size_t i = 0; i < a.profiles.size(); ++i) {
    largest = std::max(largest, std::abs(Relative(a.profiles[i], 0.65, 0.78) -
                                         Relative(b.profiles[i], 0.65, 0.78)));
  }
  return largest;
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

// Little is left there to compare the deceleration's widths with.
TEST(PhotoComb, ReadsNoDecelerationThatIsCutShortlyBehindIt) {
  const DrawnPhoto drawn = Usual();
  const cv::Mat upright = ToMat(Draw(drawn));
  for (const auto& [cropped_px, used] : {std::pair{75, true}, std::pair{130, false}}) {
    const PhotoMeasurement measured =
        MeasurePhoto(View(Cropped(upright, 0, 0, cropped_px, 0)), OptionsFor(drawn));
    ASSERT_EQ(measured.refusal, "") << cropped_px;
    for (const LineProfile& profile : measured.profiles) {
      EXPECT_EQ(profile.shows_deceleration, used) << cropped_px;
      EXPECT_TRUE(profile.shows_acceleration);
    }
  }
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

// What looks like the frame's bar may be a smear or a line: only rails that end there make it one.
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

TEST(PhotoComb, RefusesLinesWhoseSpeedChangesLieOutsideThePhoto) {
  const DrawnPhoto drawn = Usual();
  const cv::Mat upright = ToMat(Draw(drawn));
  EXPECT_NE(MeasurePhoto(View(Cropped(upright, 0, 0, 240, 0)), OptionsFor(drawn)).refusal, "");
  EXPECT_NE(MeasurePhoto(View(Cropped(upright, 150, 0, 0, 0)), OptionsFor(drawn)).refusal, "");
}

}  // namespace
}  // namespace trammel::pressure_advance
