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
#include "pressure_advance/photo/photo_eye.h"
#include "pressure_advance/photo/photo_test_support.h"

namespace trammel::pressure_advance {
namespace {

using ::testing::Contains;
using ::testing::HasSubstr;
using ::testing::Not;

// Slow ends of one length: the lines cannot tell a turn by 180 degrees from the order of the list.
DrawnPhoto Symmetric() {
  DrawnPhoto photo;
  photo.pressure_advance_s = Steps();
  photo.slow_before = photo.slow_after = 0.25;
  photo.corner_mark = true;
  return photo;
}

PhotoOptions OptionsFor(const DrawnPhoto& photo, bool corner_mark = true) {
  PhotoOptions options;
  options.pressure_advance_s = photo.pressure_advance_s;
  options.slow_before = photo.slow_before;
  options.slow_after = photo.slow_after;
  options.corner_mark = corner_mark;
  return options;
}

cv::Mat MatOf(const Frame& frame) {
  return cv::Mat(frame.height, frame.width, CV_8UC3, const_cast<std::uint8_t*>(frame.bgr.data()))
      .clone();
}

PhotoMeasurement Measure(const cv::Mat& image, const PhotoOptions& options) {
  return MeasurePhoto({image.data, image.cols, image.rows, static_cast<std::ptrdiff_t>(image.step)},
                      options);
}

// Mean width about the acceleration over that of the whole line.
double WidthAtAcceleration(const LineProfile& profile) {
  std::vector<double> all, there;
  for (const ProfileSample& sample : profile.samples) {
    if (!sample.width.seen()) continue;
    all.push_back(sample.width.value);
    if (std::abs(sample.position - 0.25) < 0.03) there.push_back(sample.width.value);
  }
  return Mean(there) / Median(all);
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
  for (const cv::Mat& way : AllWays(MatOf(Draw(drawn)))) {
    const PhotoMeasurement measured = Measure(way, OptionsFor(drawn));
    ASSERT_EQ(measured.refusal, "");
    ASSERT_EQ(measured.profiles.size(), drawn.pressure_advance_s.size());
    EXPECT_THAT(measured.notices, Contains(HasSubstr("the printed mark says")));
    // The first line, of too low a PA, is starved where it accelerates, the last one swells.
    EXPECT_LT(WidthAtAcceleration(measured.profiles.front()), 0.95);
    EXPECT_GT(WidthAtAcceleration(measured.profiles.back()), 1.05);
  }
}

// As a printer lays them that comes to each stroke with an empty nozzle.
TEST(PhotoMark, IsSeenWhereItsStrokesLieApart) {
  DrawnPhoto drawn = Symmetric();
  drawn.mark_stroke_mm = 0.5 * drawn.bead_mm;
  cv::Mat mirrored;
  cv::flip(MatOf(Draw(drawn)), mirrored, 1);
  const PhotoMeasurement measured = Measure(mirrored, OptionsFor(drawn));
  EXPECT_EQ(measured.refusal, "");
  EXPECT_THAT(measured.notices, Contains(HasSubstr("the lines start at the right")));
}

TEST(PhotoMark, WithoutItASymmetricPatternAsksWhereItStarts) {
  DrawnPhoto drawn = Symmetric();
  drawn.corner_mark = false;
  cv::Mat upside_down;
  cv::rotate(MatOf(Draw(drawn)), upside_down, cv::ROTATE_180);
  for (const bool promised : {false, true}) {
    PhotoOptions options = OptionsFor(drawn);
    options.corner_mark = promised;
    const PhotoMeasurement measured = Measure(upside_down, options);
    for (const std::string& notice : measured.notices) {
      EXPECT_THAT(notice, Not(HasSubstr("the printed mark says")));
    }
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
    cv::Mat image = MatOf(Draw(drawn));
    Random random(seed);
    if (seed % 2 == 1) AddBlob(drawn, random, image);
    const PhotoMeasurement measured = Measure(image, OptionsFor(drawn));
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
    cv::flip(MatOf(Draw(drawn)), mirrored, 1);
    Random random(seed);
    if (seed % 2 == 1) AddBlob(drawn, random, mirrored);
    const PhotoMeasurement measured = Measure(mirrored, OptionsFor(drawn));
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
  EXPECT_THAT(Measure(MatOf(Draw(drawn)), options).refusal, HasSubstr("the other end"));
  options.start = PhotoSide::kLeft;
  EXPECT_EQ(Measure(MatOf(Draw(drawn)), options).refusal, "");
}

DrawnPhoto Usual() {
  DrawnPhoto photo;
  photo.pressure_advance_s = Steps();
  return photo;
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
  const cv::Mat upright = MatOf(Draw(drawn));
  const PhotoMeasurement reference = MeasurePhoto(View(upright), OptionsFor(drawn, false));
  ASSERT_EQ(reference.refusal, "");
  const auto compare = [&](const cv::Mat& picture, const char* what) {
    const PhotoMeasurement measured = MeasurePhoto(View(picture), OptionsFor(drawn, false));
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
  const cv::Mat upright = MatOf(Draw(drawn));
  for (const auto& [cropped_px, used] : {std::pair{75, true}, std::pair{130, false}}) {
    const PhotoMeasurement measured =
        MeasurePhoto(View(Cropped(upright, 0, 0, cropped_px, 0)), OptionsFor(drawn, false));
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
  const cv::Mat cropped = Cropped(MatOf(Draw(drawn)), 0, 0, 0, 165);
  cv::Mat upside_down;
  cv::rotate(cropped, upside_down, cv::ROTATE_180);
  for (const cv::Mat& picture : {cropped, upside_down}) {
    const PhotoMeasurement measured = MeasurePhoto(View(picture), OptionsFor(drawn, false));
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
  const cv::Mat upright = MatOf(Draw(drawn));
  const cv::Mat cut = Cropped(upright, 0, 80, 0, 165);
  EXPECT_NE(MeasurePhoto(View(cut), OptionsFor(drawn, false)).refusal, "");
  DrawnPhoto straight = drawn;
  straight.roll_rad = straight.tilt = straight.bow = 0;
  cv::Mat longer = Cropped(MatOf(Draw(straight)), 0, 0, 0, 165);
  EXPECT_EQ(MeasurePhoto(View(longer), OptionsFor(drawn, false)).refusal, "");
  // The bar lies in the rows 62 … 75, below them plate and the two rails.
  for (int y = 52; y >= 0; y -= 10) {
    longer(cv::Rect(0, 85, longer.cols, 10)).copyTo(longer(cv::Rect(0, y, longer.cols, 10)));
  }
  EXPECT_NE(MeasurePhoto(View(longer), OptionsFor(drawn, false)).refusal, "");
}

// A print whose list is shifted by one value gives the same picture: nothing in it tells which of
// the lines these are.
TEST(PhotoComb, RefusesLinesWhoseNeighboursAreCutOffAtBothSides) {
  const DrawnPhoto drawn = Usual();
  DrawnPhoto shifted = drawn;
  const double step_s = drawn.pressure_advance_s[1] - drawn.pressure_advance_s[0];
  for (double& value : shifted.pressure_advance_s) value += step_s;
  shifted.right_value_s += step_s;
  const cv::Mat picture = Cropped(MatOf(Draw(drawn)), 0, 165, 0, 165);
  EXPECT_EQ(cv::norm(picture, Cropped(MatOf(Draw(shifted)), 0, 165, 0, 165), cv::NORM_INF), 0);
  EXPECT_THAT(MeasurePhoto(View(picture), OptionsFor(drawn, false)).refusal,
              HasSubstr("shifted by a line would look the same"));
}

TEST(PhotoComb, RefusesLinesWhoseSpeedChangesLieOutsideThePhoto) {
  const DrawnPhoto drawn = Usual();
  const cv::Mat upright = MatOf(Draw(drawn));
  EXPECT_NE(MeasurePhoto(View(Cropped(upright, 0, 0, 240, 0)), OptionsFor(drawn, false)).refusal,
            "");
  EXPECT_NE(MeasurePhoto(View(Cropped(upright, 150, 0, 0, 0)), OptionsFor(drawn, false)).refusal,
            "");
}

}  // namespace
}  // namespace trammel::pressure_advance
