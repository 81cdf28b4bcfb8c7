// The mark that says which way a photo shows the pattern.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <opencv2/core.hpp>
#include <opencv2/imgproc.hpp>
#include <string>
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

PhotoOptions OptionsFor(const DrawnPhoto& photo) {
  PhotoOptions options;
  options.pressure_advance_s = photo.pressure_advance_s;
  options.slow_before = photo.slow_before;
  options.slow_after = photo.slow_after;
  options.corner_mark = true;
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

}  // namespace
}  // namespace trammel::pressure_advance
