#include "pressure_advance/photo/photo_reader.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <filesystem>
#include <opencv2/core.hpp>
#include <opencv2/imgcodecs.hpp>
#include <opencv2/imgproc.hpp>
#include <string>
#include <vector>

#include "base/statistics.h"
#include "pressure_advance/photo/photo_test_support.h"

namespace trammel::pressure_advance {
namespace {

using ::testing::Contains;
using ::testing::HasSubstr;

struct WidthErrors {
  double bias = 0, scatter = 0, predicted = 0;  // over the usual width
};

// Against the drawn widths, leaving out the ends, where fillets and bars blur into the lines.
WidthErrors Errors(const PhotoMeasurement& measured, const DrawnPhoto& drawn) {
  std::vector<double> errors, sigmas;
  for (const LineProfile& profile : measured.profiles) {
    const double usual = UsualWidth(profile);
    for (const ProfileSample& sample : profile.samples) {
      if (sample.position < 0.03 || sample.position > 0.97) continue;
      const double expected =
          DrawnWidth_mm(drawn, profile.pressure_advance_s, sample.position) / drawn.bead_mm;
      errors.push_back(sample.width.value / usual - expected);
      sigmas.push_back(sample.width.sigma / usual);
    }
  }
  return {Mean(errors), RobustStandardDeviation(errors), Median(sigmas)};
}

TEST(PhotoReader, MeasuresDrawnWidthsWithoutNoise) {
  DrawnPhoto drawn = Usual();
  drawn.grain = drawn.noise = 0;
  const Frame photo = Draw(drawn);
  const PhotoMeasurement measured = MeasurePhoto(photo.view(), OptionsFor(drawn));
  ASSERT_EQ(measured.refusal, "");
  ASSERT_EQ(measured.profiles.size(), drawn.pressure_advance_s.size());
  const WidthErrors errors = Errors(measured, drawn);
  // A bead of 10 px with edges blurred over 1 px: half a percent is 0.05 px.
  EXPECT_NEAR(errors.bias, 0, 0.01);
  EXPECT_LT(errors.scatter, 0.015);
}

// Slicer's preview: lines of one width on a plate of one colour.
TEST(PhotoReader, NamesADrawingAsTheCause) {
  DrawnPhoto drawn = Usual();
  drawn.grain = drawn.noise = drawn.unevenness = 0;
  const Frame photo = Draw(drawn);
  const PhotoMeasurement measured = MeasurePhoto(photo.view(), OptionsFor(drawn));
  EXPECT_THAT(measured.refusal, HasSubstr("a drawing"));
}

TEST(PhotoReader, ReadsTexturedPlatesWithHonestSigma) {
  for (const bool darker : {false, true}) {
    DrawnPhoto drawn = Usual();
    drawn.darker = darker;
    drawn.seed = darker ? 11 : 12;
    const Frame photo = Draw(drawn);
    const PhotoMeasurement measured = MeasurePhoto(photo.view(), OptionsFor(drawn));
    ASSERT_EQ(measured.refusal, "") << "seed " << drawn.seed;
    const WidthErrors errors = Errors(measured, drawn);
    EXPECT_NEAR(errors.bias, 0, 0.02) << "seed " << drawn.seed;
    EXPECT_LT(errors.scatter, 0.06) << "seed " << drawn.seed;
    // Honest: neither half nor twice what is observed.
    EXPECT_LT(errors.predicted, 2 * errors.scatter) << "seed " << drawn.seed;
    EXPECT_GT(errors.predicted, 0.5 * errors.scatter) << "seed " << drawn.seed;
  }
}

TEST(PhotoReader, FindsWhereTheSpeedChanges) {
  const DrawnPhoto drawn = Usual();
  const PhotoMeasurement measured = MeasurePhoto(Draw(drawn).view(), OptionsFor(drawn));
  ASSERT_TRUE(measured.segments.has_value()) << measured.refusal;
  EXPECT_NEAR(measured.segments->fast_begin, 0.1, 0.02);
  EXPECT_NEAR(measured.segments->fast_end, 0.7, 0.01);
}

TEST(PhotoReader, FindsTheFirstLineHoweverThePhotoIsHeld) {
  const DrawnPhoto drawn = Usual();
  const cv::Mat upright = ToMat(Draw(drawn));
  PhotoOptions options = OptionsFor(drawn);
  const PhotoMeasurement reference = MeasurePhoto(View(upright), options);
  ASSERT_EQ(reference.refusal, "");
  options.from.reset();
  const auto compare = [&](const cv::Mat& held, PhotoSide first_line) {
    const PhotoMeasurement measured = MeasurePhoto(View(held), options);
    ASSERT_EQ(measured.refusal, "") << ToString(first_line);
    EXPECT_EQ(measured.first_line, first_line);
    EXPECT_LT(Difference(reference, measured), 0.03) << ToString(first_line);
  };
  compare(upright, PhotoSide::kBottom);
  for (const auto& [code, first_line] :
       {std::pair{cv::ROTATE_90_CLOCKWISE, PhotoSide::kLeft},
        std::pair{cv::ROTATE_180, PhotoSide::kTop},
        std::pair{cv::ROTATE_90_COUNTERCLOCKWISE, PhotoSide::kRight}}) {
    cv::Mat held;
    cv::rotate(upright, held, code);
    compare(held, first_line);
    cv::flip(held, held, code == cv::ROTATE_180 ? 1 : 0);
    compare(held, first_line);
  }
}

TEST(PhotoReader, AsksForTheFirstLineWhereNothingShowsIt) {
  DrawnPhoto drawn = Usual();
  drawn.slow_before = drawn.slow_after = 0.25;  // the same turned round with the order reversed
  PhotoOptions options = OptionsFor(drawn);
  options.from.reset();
  cv::Mat held;
  cv::rotate(ToMat(Draw(drawn)), held, cv::ROTATE_90_CLOCKWISE);
  EXPECT_THAT(MeasurePhoto(View(held), options).refusal, HasSubstr("--from"));
  options.from = PhotoSide::kLeft;
  EXPECT_EQ(MeasurePhoto(View(held), options).refusal, "");
}

TEST(PhotoReader, FindsTheStartOfSymmetricLinesByPhysics) {
  DrawnPhoto drawn = Usual();
  drawn.slow_before = drawn.slow_after = 0.25;
  const cv::Mat upright = ToMat(Draw(drawn));
  const PhotoMeasurement straight = MeasurePhoto(View(upright), OptionsFor(drawn));
  ASSERT_EQ(straight.refusal, "");
  ASSERT_TRUE(straight.segments.has_value());
  EXPECT_NEAR(straight.segments->fast_end, 0.75, 0.02);
  cv::Mat mirrored;
  cv::flip(upright, mirrored, 1);
  const PhotoMeasurement measured = MeasurePhoto(View(mirrored), OptionsFor(drawn));
  ASSERT_TRUE(measured.segments.has_value()) << measured.refusal;
  EXPECT_NEAR(measured.segments->fast_end, 0.75, 0.02);
}

TEST(PhotoReader, AsksForTheStartWhereTheLinesDoNotShowIt) {
  DrawnPhoto drawn = Usual();
  drawn.slow_before = drawn.slow_after = 0.25;
  drawn.right_value_s = 0;
  const Frame photo = [&] {
    DrawnPhoto alike = drawn;  // all lines at the right value
    alike.pressure_advance_s.assign(drawn.pressure_advance_s.size(), 0.0);
    return Draw(alike);
  }();
  PhotoOptions options = OptionsFor(drawn);
  EXPECT_THAT(MeasurePhoto(photo.view(), options).refusal, HasSubstr("give the side"));
  options.start = PhotoSide::kLeft;
  EXPECT_EQ(MeasurePhoto(photo.view(), options).refusal, "");
}

TEST(PhotoReader, RefusesSidesAcrossTheLines) {
  const DrawnPhoto drawn = Usual();
  const Frame photo = Draw(drawn);
  PhotoOptions options = OptionsFor(drawn);
  options.from = PhotoSide::kLeft;
  EXPECT_THAT(MeasurePhoto(photo.view(), options).refusal, HasSubstr("cannot lie at the left"));
  options.from = PhotoSide::kBottom;
  options.start = PhotoSide::kTop;
  EXPECT_THAT(MeasurePhoto(photo.view(), options).refusal, HasSubstr("cannot start at the top"));
}

TEST(PhotoReader, NamesLinesByTheirPlacesWhereSomeAreMissing) {
  DrawnPhoto drawn = Usual();
  drawn.left_out = {5};
  PhotoOptions options = OptionsFor(drawn);
  const std::vector<double> all = Steps(13);
  std::vector<double> rest = all;
  rest.erase(rest.begin() + 5);
  for (const std::vector<double>& list : {all, rest}) {
    options.pressure_advance_s = list;
    const PhotoMeasurement measured = MeasurePhoto(Draw(drawn).view(), options);
    ASSERT_EQ(measured.refusal, "");
    ASSERT_EQ(measured.profiles.size(), rest.size());
    for (std::size_t i = 0; i < rest.size(); ++i) {
      EXPECT_EQ(measured.profiles[i].pressure_advance_s, rest[i]);
    }
  }
  options.pressure_advance_s = all;
  options.pressure_advance_s[5] = 0.1 - 0.075;  // 0.025000000000000008
  EXPECT_THAT(MeasurePhoto(Draw(drawn).view(), options).notices,
              Contains(HasSubstr("(those at 0.025 s)")));
  // Given as many values as lines, but a list with its gap elsewhere.
  options.pressure_advance_s = all;
  options.pressure_advance_s.erase(options.pressure_advance_s.begin() + 8);
  EXPECT_THAT(MeasurePhoto(Draw(drawn).view(), options).refusal, HasSubstr("check the list"));
}

TEST(PhotoReader, NamesAnotherPrintsLengthOfLines) {
  const DrawnPhoto drawn = Usual();
  PhotoOptions options = OptionsFor(drawn);
  options.framed = false;
  options.length_pitches = 0.5 * drawn.length_mm / drawn.spacing_mm;
  const std::string refusal = MeasurePhoto(Draw(drawn).view(), options).refusal;
  EXPECT_THAT(refusal, HasSubstr("in the file they are 8 times as long"));
  EXPECT_THAT(refusal, HasSubstr("is it the photo of this print, and are the whole lines in it?"));
}

TEST(PhotoReader, RefusesPhotosWithoutAWholePattern) {
  const DrawnPhoto drawn = Usual();
  DrawnPhoto none = drawn;
  none.frame = false;
  none.bead_mm = 0;
  EXPECT_THAT(MeasurePhoto(Draw(none).view(), OptionsFor(drawn)).refusal, HasSubstr("lines"));
  DrawnPhoto half = drawn;
  half.shift_y_mm = 40;
  EXPECT_NE(MeasurePhoto(Draw(half).view(), OptionsFor(drawn)).refusal, "");
  const Frame black(400, 300);
  EXPECT_NE(MeasurePhoto(black.view(), OptionsFor(drawn)).refusal, "");
  EXPECT_NE(MeasurePhoto({}, OptionsFor(drawn)).refusal, "");
}

TEST(PhotoReader, RefusesBlurredAndTinyPhotos) {
  DrawnPhoto blurred = Usual();
  blurred.blur_px = 7;
  EXPECT_NE(MeasurePhoto(Draw(blurred).view(), OptionsFor(blurred)).refusal, "");
  const Frame photo = Draw(Usual());
  cv::Mat tiny;
  cv::resize(ToMat(photo), tiny, {}, 0.15, 0.15, cv::INTER_AREA);
  EXPECT_NE(MeasurePhoto(View(tiny), OptionsFor(Usual())).refusal, "");
}

class RealPhotos : public ::testing::Test {
 protected:
  void SetUp() override {
    const char* folder = std::getenv("TRAMMEL_TEST_DATA");
    if (folder == nullptr) {
      GTEST_SKIP() << "set TRAMMEL_TEST_DATA to the folder with pressure_advance_photos/";
    }
    folder_ = std::filesystem::path(folder) / "pressure_advance_photos";
    options_.pressure_advance_s = Steps(21);
  }

  [[nodiscard]] cv::Mat Load(const std::string& name) const {
    return cv::imread((folder_ / name).string(), cv::IMREAD_COLOR);
  }

  std::filesystem::path folder_;
  PhotoOptions options_;
};

TEST_F(RealPhotos, AreReadWithBulgesAndBreaksWhereTheyBelong) {
  for (const char* name : {"black45_lines4-5.jpg", "gold50_lines4-5.jpg", "gray45_lines5-6.jpg",
                           "gray60_lines5-6.jpg"}) {
    const cv::Mat photo = Load(name);
    ASSERT_FALSE(photo.empty()) << name;
    const PhotoMeasurement measured = MeasurePhoto(View(photo), options_);
    ASSERT_EQ(measured.refusal, "") << name;
    ASSERT_EQ(measured.profiles.size(), 21U) << name;
    ASSERT_TRUE(measured.segments.has_value()) << name;
    EXPECT_NEAR(measured.segments->fast_end, 0.71, 0.03) << name;
    std::vector<double> usual;
    for (const LineProfile& profile : measured.profiles) {
      EXPECT_EQ(profile.unusable, "") << name;
      usual.push_back(UsualWidth(profile));
    }
    // All lines carry the same flow; light and perspective may not change that by a fifth.
    for (const double width : usual) EXPECT_NEAR(width / Median(usual), 1, 0.2) << name;
    EXPECT_GT(Relative(measured.profiles[0], 0.69, 0.74), 1.1) << name;
    EXPECT_LT(Relative(measured.profiles[18], 0.69, 0.74), 0.3) << name;
    EXPECT_GT(Relative(measured.profiles[19], 0.09, 0.14), 1.2) << name;
  }
}

TEST_F(RealPhotos, AreRefusedWhereHalfIsMissing) {
  const cv::Mat photo = Load("black45_lines4-5.jpg");
  ASSERT_FALSE(photo.empty());
  for (const cv::Rect& part :
       {cv::Rect(0, 0, photo.cols, photo.rows / 2), cv::Rect(0, 0, photo.cols / 2, photo.rows),
        cv::Rect(photo.cols / 2, 0, photo.cols / 2, photo.rows)}) {
    const PhotoMeasurement measured = MeasurePhoto(View(photo(part)), options_);
    EXPECT_NE(measured.refusal, "") << part.x << " " << part.y << " " << part.width;
    EXPECT_TRUE(measured.profiles.empty());
  }
}

}  // namespace
}  // namespace trammel::pressure_advance
