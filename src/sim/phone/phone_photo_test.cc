#include "sim/phone/phone_photo.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <opencv2/imgcodecs.hpp>

namespace trammel::sim {
namespace {

using ::testing::HasSubstr;

constexpr double kDegree = 0.017453292519943295;
// Rows in quarters (0.02 px of a leaning edge) and bytes of a 7 px wide line (0.01 px).
constexpr double kCentroidPx = 0.03;
constexpr double kClosedFormPx = 1e-6;

// Upright lines of 0.4 mm, 30 mm long, at the given x; tools in turn.
PrintedSheet Lines(const std::vector<double>& x_mm) {
  PrintedSheet sheet;
  sheet.paper = {0.8, 0.8, 0.8};
  int tool = 0;
  for (const double x : x_mm) {
    InkStroke stroke{tool++, 1, true, {0, 1}, {}};
    for (int i = 0; i <= 60; ++i) stroke.points.push_back({{x, 85 + 0.5 * i}, 0.2, 0.2});
    sheet.strokes.push_back(stroke);
  }
  return sheet;
}

PhoneTraits Small() {
  PhoneTraits traits;
  traits.width_px = 800;
  traits.height_px = 640;
  traits.gamma = 1;
  return traits;
}

// Centre of the darkness in a row within a window, px from the first pixel's outer corner.
double DarkAt(const Frame& frame, int row, double about_px) {
  double sum = 0;
  double moment = 0;
  const int middle = static_cast<int>(about_px);
  for (int x = std::max(0, middle - 14); x <= std::min(frame.width - 1, middle + 14); ++x) {
    const double dark = 204.0 - frame.view().row(row)[3 * x + 1];
    sum += dark;
    moment += dark * (x + 0.5);
  }
  return sum > 0 ? moment / sum : std::numeric_limits<double>::quiet_NaN();
}

TEST(PhoneMap, StraightAboveIsAPinhole) {
  const PrintedSheet sheet = Lines({90, 110});  // centred at (100, 100)
  const PhoneMap map(sheet, PhoneTraits{});
  const PixelPlace place = map.PixelOf({110, 105});
  EXPECT_NEAR(place.x_px, 2016 + 5600 * 10 / 310.0, kClosedFormPx);
  EXPECT_NEAR(place.y_px, 1512 - 5600 * 5 / 310.0, kClosedFormPx);
  const PixelPlace high = map.PixelOf({110, 105}, 0.25);
  EXPECT_NEAR(high.x_px, 2016 + 5600 * 10 / 309.75, kClosedFormPx);
}

TEST(PhoneMap, TiltMovesTheFarSideAway) {
  const PrintedSheet sheet = Lines({90, 110});
  for (const double tilt : {5 * kDegree, 25 * kDegree}) {
    PhoneTraits traits;
    traits.tilt_rad = tilt;
    const PhoneMap right(sheet, traits);
    const double expected = 10 * std::cos(tilt) / (310 + 10 * std::sin(tilt));
    EXPECT_NEAR(right.PixelOf({110, 100}).x_px, 2016 + 5600 * expected, kClosedFormPx);
    // A line's height shows as a shift against the tilt.
    const double raised = (10 * std::cos(tilt) + 0.2 * std::sin(tilt)) /
                          (310 + 10 * std::sin(tilt) - 0.2 * std::cos(tilt));
    EXPECT_NEAR(right.PixelOf({110, 100}, 0.2).x_px, 2016 + 5600 * raised, kClosedFormPx);
    traits.tilt_to_rad = 90 * kDegree;  // the upper side falls away
    const PhoneMap up(sheet, traits);
    EXPECT_NEAR(up.PixelOf({100, 110}).y_px, 1512 - 5600 * expected, kClosedFormPx);
  }
}

TEST(PhoneMap, TurnGoesCounterClockwiseInThePicture) {
  PhoneTraits traits;
  traits.turn_rad = 90 * kDegree;
  const PhoneMap map(Lines({90, 110}), traits);
  const PixelPlace place = map.PixelOf({110, 100});
  EXPECT_NEAR(place.x_px, 2016, kClosedFormPx);
  EXPECT_NEAR(place.y_px, 1512 - 5600 * 10 / 310.0, kClosedFormPx);
}

TEST(PhoneMap, LensAndBowFollowTheirPolynomials) {
  PhoneTraits traits;
  traits.radial = {0.02, -0.3, 0.5};
  const PhoneMap lens(Lines({90, 110}), traits);
  const double r = 10 / 310.0;
  EXPECT_NEAR(lens.PixelOf({110, 100}).x_px,
              2016 + 5600 * r * (1 + 0.02 * r * r - 0.3 * std::pow(r, 4) + 0.5 * std::pow(r, 6)),
              kClosedFormPx);
  traits = {};
  traits.bow_mm = 1;
  const PhoneMap bow(Lines({90, 110}), traits);
  // The print is 20 x 30 mm: its corners lie hypot(10, 15) from the middle.
  EXPECT_NEAR(bow.PaperHeightAt(10, 3), 100.0 / 325, 1e-9);
  EXPECT_NEAR(bow.PixelOf({110, 100}).x_px, 2016 + 5600 * 10 / (310 - 100.0 / 325), kClosedFormPx);
}

TEST(PhonePhoto, RaisedLinesLieWhereTheMapPutsThem) {
  const PrintedSheet sheet = Lines({90, 97, 104, 110});
  PhoneTraits traits = Small();
  traits.tilt_rad = 25 * kDegree;
  traits.tilt_to_rad = 0;
  traits.radial = {0.03, 0, 0};
  traits.bow_mm = 1;
  traits.line_height_mm = 0.2;
  traits.extra_height_mm[1] = 0.03;
  traits.extra_height_mm[3] = -0.03;
  const auto frame = PhotographSheet(sheet, traits, Random(1));
  ASSERT_TRUE(frame) << frame.error().message;
  const PhoneMap map(sheet, traits);
  for (std::size_t i = 0; i < sheet.strokes.size(); ++i) {
    const double x = sheet.strokes[i].points[0].centre.x_mm;
    const double height = 0.2 + traits.extra_height_mm[i];
    // Row 320's middle is half a pixel below the sheet's middle line.
    const PixelPlace left = map.PixelOf({x - 0.2, 99.97}, height);
    const PixelPlace right = map.PixelOf({x + 0.2, 99.97}, height);
    const double expected = (left.x_px + right.x_px) / 2;
    EXPECT_NEAR(DarkAt(*frame, 320, expected), expected, kCentroidPx) << i;
  }
}

TEST(PhonePhoto, JpegBearsTheFocalLength) {
  PhoneTraits traits = Small();
  traits.width_px = 4032;
  traits.height_px = 3024;
  const std::string jpeg = PhoneJpeg(Frame(64, 64), traits);
  // 5600 px of a diagonal of 5040 px are 48 mm on film: FocalLengthIn35mmFilm, a short.
  EXPECT_THAT(jpeg, HasSubstr(std::string("\x05\xa4\x03\x00\x01\x00\x00\x00\x30\x00", 10)));
  const cv::Mat raw(1, static_cast<int>(jpeg.size()), CV_8U, const_cast<char*>(jpeg.data()));
  EXPECT_EQ(cv::imdecode(raw, cv::IMREAD_COLOR).cols, 64);
}

}  // namespace
}  // namespace trammel::sim
