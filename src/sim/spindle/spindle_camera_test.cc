#include "sim/spindle/spindle_camera.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>

#include "base/statistics.h"

namespace trammel::sim {
namespace {

constexpr std::uint64_t kSeed = 62;  // development
// Rounding to whole grey levels (0.29 each) on the 2 pi r = 100 … 300 edge pixels of a disc with a
// contrast of 200: 0.29 / 200 · sqrt(2 / 100) = 2e-4 px; the split of edge pixels adds no more.
constexpr double kCentre_px = 6e-4;

SpindlePicture PlainPicture() {
  SpindlePicture picture;
  picture.lens = AsRealCamera(SpindleLens{});
  picture.lens.width_px = 640;
  picture.lens.height_px = 480;
  picture.light = {.white = 220, .dark = 20, .surface = 20};
  picture.eye = {.blur_px = 0, .read_noise = 0, .shot_noise = 0};
  return picture;
}

// Straight ahead of the camera at 300 mm, moved aside, facing it, tilted about x, turned about z.
PlacedTarget TargetAt(double x_mm, double y_mm, double tilt_rad, double turn_rad = 0) {
  PlacedTarget target;
  target.camera_from_target = {{x_mm, y_mm, 300},
                               TurnX(std::numbers::pi + tilt_rad) * TurnZ(turn_rad)};
  return target;
}

// Middle of the area of the disc's image: its outline, projected point by point.
PixelPlace MiddleOfOutline(const SpindleLens& lens, const PlacedTarget& target) {
  constexpr int kPoints = 4000;
  double area = 0;
  PixelPlace sum = {};
  PixelPlace last = {};
  for (int i = 0; i <= kPoints; ++i) {
    const double angle = 2 * std::numbers::pi * i / kPoints;
    const double r = target.pattern.dot_radius_mm;
    const PixelPlace at =
        SeenAt(lens, target.camera_from_target.Out({r * std::cos(angle), r * std::sin(angle), 0}))
            .value();
    if (i > 0) {
      const double cross = last[0] * at[1] - last[1] * at[0];
      area += cross;
      for (std::size_t k = 0; k < 2; ++k) sum[k] += cross * (last[k] + at[k]) / 3;
    }
    last = at;
  }
  return {sum[0] / area, sum[1] / area};
}

// Middle of what is brighter than the ground.
PixelPlace MiddleOfLight(const Page& page) {
  double mass = 0;
  PixelPlace sum = {};
  for (int y = 0; y < page.height; ++y) {
    for (int x = 0; x < page.width; ++x) {
      const double value = page.samples[static_cast<std::size_t>(y * page.width + x)] - 20.0;
      mass += value;
      sum[0] += value * x;
      sum[1] += value * y;
    }
  }
  return {sum[0] / mass, sum[1] / mass};
}

Page Taken(const SpindlePicture& picture) {
  auto page = TakePicture(picture, Random(kSeed));
  EXPECT_TRUE(page) << (page ? "" : page.error().message);
  return page ? *page : Page{};
}

TEST(SpindleCamera, DiscLiesWhereItsOutlineIsProjectedAtEveryTiltAndUnderTheLens) {
  for (const double tilt_deg : {0.0, 5.0, 30.0, 50.0}) {
    SpindlePicture picture = PlainPicture();
    PlacedTarget target = TargetAt(11.3, -7.7, tilt_deg * std::numbers::pi / 180, 0.3);
    target.pattern.dot_radius_mm = 5;
    picture.targets = {target};
    const PixelPlace seen = MiddleOfLight(Taken(picture));
    const PixelPlace meant = MiddleOfOutline(picture.lens, target);
    EXPECT_NEAR(seen[0], meant[0], kCentre_px) << tilt_deg << " degrees";
    EXPECT_NEAR(seen[1], meant[1], kCentre_px) << tilt_deg << " degrees";
  }
}

// The centre of the ellipse is not the image of the centre: r² f sin(tilt) cos(tilt) / z² in px, to
// 1 %, for a disc on the axis.
TEST(SpindleCamera, TiltMovesTheEllipseFromTheImageOfTheCentre) {
  SpindlePicture picture = PlainPicture();
  picture.lens.principal_offset_px = {0, 0};
  picture.lens.k1 = picture.lens.k2 = picture.lens.p1 = picture.lens.p2 = 0;
  for (const double tilt_deg : {5.0, 30.0}) {
    const double tilt = tilt_deg * std::numbers::pi / 180;
    PlacedTarget target = TargetAt(0, 0, tilt);
    target.pattern.dot_radius_mm = 5;
    picture.targets = {target};
    const double moved = MiddleOfLight(Taken(picture))[1] - 239.5;
    const double expected = 25 * FocalPx(picture.lens) * std::sin(tilt) * std::cos(tilt) / 9e4;
    EXPECT_NEAR(std::abs(moved), expected, 0.01 * expected + kCentre_px) << tilt_deg;
  }
}

TEST(SpindleCamera, BlurAndMotionMoveNoCentre) {
  SpindlePicture picture = PlainPicture();
  picture.targets = {TargetAt(3.21, 4.56, 0.2)};
  picture.eye.blur_px = 1.7;
  picture.eye.motion_px = 5.3;
  picture.eye.motion_rad = 0.7;
  const PixelPlace seen = MiddleOfLight(Taken(picture));
  const PixelPlace meant = MiddleOfOutline(picture.lens, picture.targets[0]);
  EXPECT_NEAR(seen[0], meant[0], 2 * kCentre_px);
  EXPECT_NEAR(seen[1], meant[1], 2 * kCentre_px);
}

// The pattern by its definition, at a point of its plane.
bool WhiteAt(const RingPattern& pattern, double x, double y) {
  const double r = std::hypot(x, y);
  if (r < pattern.dot_radius_mm) return true;
  if (pattern.bits == 0 || r < pattern.ring_inner_mm || r > pattern.ring_outer_mm) return false;
  double angle = (pattern.clockwise ? -1 : 1) * std::atan2(y, x) - pattern.first_rad;
  angle -= 2 * std::numbers::pi * std::floor(angle / (2 * std::numbers::pi));
  const int bit = static_cast<int>(angle / (2 * std::numbers::pi) * pattern.bits);
  return (pattern.word >> std::min(bit, pattern.bits - 1) & 1U) != 0;
}

TEST(SpindleRing, CoversWhatASquareOf200By200PointsCounts) {
  // Straight edges in a sixteenth of a pixel: 1e-3 off the corners of segments, where two edges
  // meet in one piece; 200 points a side count an edge to 1 / 200 / sqrt(200).
  constexpr double kEdge = 2e-3;
  constexpr double kCorner = 2e-2;
  Random random(kSeed);
  for (int i = 0; i < 400; ++i) {
    RingPattern pattern;
    pattern.bits = random.Uniform() < 0.5 ? 14 : 0;
    pattern.word = static_cast<std::uint32_t>(random.Below(1U << 14U));
    pattern.clockwise = random.Uniform() < 0.5;
    pattern.first_rad = random.Uniform(-4, 4);
    const double px = random.Uniform(0.1, 0.45);  // dot: 4.4 … 20 px
    const double r =
        random.Uniform() < 0.5 ? 2 + random.Uniform(-1, 1) * px : random.Uniform(3.5, 6.5);
    const double at = random.Uniform(-4, 4);
    PixelOnTarget pixel = {{r * std::cos(at), r * std::sin(at)},
                           {{{px, 0.2 * px}, {-0.1 * px, 0.8 * px}}}};
    int white = 0;
    for (int j = 0; j < 40000; ++j) {
      const double right = (j % 200 + 0.5) / 200 - 0.5;
      const double down = (j / 200 + 0.5) / 200 - 0.5;
      white += WhiteAt(pattern,
                       pixel.at_mm[0] + pixel.by_pixel[0][0] * right + pixel.by_pixel[0][1] * down,
                       pixel.at_mm[1] + pixel.by_pixel[1][0] * right + pixel.by_pixel[1][1] * down);
    }
    EXPECT_NEAR(CoverOf(pattern, {}, pixel).white, white / 40000.0,
                pattern.bits == 0 ? kEdge : kCorner)
        << "seed " << kSeed << " number " << i;
  }
}

// Reads the ring at the middle of its segments, clockwise in the picture, from its first segment.
std::uint32_t WordInPicture(const Page& page, const SpindleLens& lens, const PlacedTarget& target) {
  const RingPattern& pattern = target.pattern;
  const double r = 0.5 * (pattern.ring_inner_mm + pattern.ring_outer_mm) * FocalPx(lens) / 300;
  const PixelPlace middle = SeenAt(lens, target.camera_from_target.origin_mm).value();
  std::uint32_t word = 0;
  for (int i = 0; i < pattern.bits; ++i) {
    const double angle = 2 * std::numbers::pi * (i + 0.5) / pattern.bits;  // rows run down
    const auto x = static_cast<int>(std::lround(middle[0] + r * std::cos(angle)));
    const auto y = static_cast<int>(std::lround(middle[1] + r * std::sin(angle)));
    if (page.samples[static_cast<std::size_t>(y * page.width + x)] > 120) word |= 1U << i;
  }
  return word;
}

TEST(SpindleCamera, ShowsTheWordClockwiseToARealCameraAndMirroredToTable1) {
  SpindlePicture picture = PlainPicture();
  PlacedTarget target = TargetAt(0, 0, 0);
  target.pattern.bits = 12;
  target.pattern.word = 0b000100110111;
  picture.targets = {target};
  EXPECT_EQ(WordInPicture(Taken(picture), picture.lens, target), target.pattern.word);

  picture.lens.along_plus_z = false;
  picture.targets[0].camera_from_target = {{0, 0, -300}, TurnZ(std::numbers::pi)};
  std::uint32_t mirrored = 0;
  for (int i = 0; i < 12; ++i) mirrored |= (target.pattern.word >> (11 - i) & 1U) << i;
  EXPECT_EQ(WordInPicture(Taken(picture), picture.lens, picture.targets[0]), mirrored);
}

TEST(SpindleCamera, WedgeHidesAQuarterOfTheRingAndLeavesTheDot) {
  SpindlePicture picture = PlainPicture();
  PlacedTarget target = TargetAt(0, 0, 0);
  target.pattern.bits = 12;
  target.pattern.word = 0b111111111111;
  target.hidden = {{-std::numbers::pi / 4, std::numbers::pi / 2, 2.5}};  // to the right
  picture.targets = {target};
  picture.light.hidden = 20;
  EXPECT_EQ(WordInPicture(Taken(picture), picture.lens, target), 0b001111111100U << 0U)
      << "the segments within 45 degrees of the x axis";
  const PixelPlace middle = SeenAt(picture.lens, {0, 0, 300}).value();
  const auto x = static_cast<int>(std::lround(middle[0]));
  const auto y = static_cast<int>(std::lround(middle[1]));
  EXPECT_EQ(Taken(picture).samples[static_cast<std::size_t>(y * 640 + x)], 220);
}

TEST(SpindleCamera, NoiseGrowsWithTheLightAsShotNoiseDoes) {
  SpindlePicture picture = PlainPicture();
  picture.eye.read_noise = 2;
  picture.eye.shot_noise = 0.04;
  for (const double surface : {40.0, 160.0}) {
    picture.light.surface = surface;
    const Page page = Taken(picture);
    const std::vector<double> grey(page.samples.begin(), page.samples.end());
    const double expected = std::sqrt(4 + 0.04 * surface + 1.0 / 12);  // rounding: 1/12
    // 307,200 pixels: the standard error of a standard deviation is 0.0013 of it.
    EXPECT_NEAR(StandardDeviation(grey), expected, 0.006 * expected);
    EXPECT_NEAR(Mean(grey), surface, 0.05);
  }
}

TEST(SpindleCamera, LightFallsOffToTheCornersAndAcross) {
  SpindlePicture picture = PlainPicture();
  picture.light.surface = 200;
  picture.light.vignetting = 0.5;
  const Page round = Taken(picture);
  EXPECT_NEAR(round.samples.front(), 100, 1);
  EXPECT_NEAR(round.samples[240 * 640 + 320], 200, 1);
  picture.light.vignetting = 0;
  picture.light.gradient = 0.4;
  const Page across = Taken(picture);
  EXPECT_NEAR(across.samples[240 * 640], 160, 1);
  EXPECT_NEAR(across.samples[240 * 640 + 639], 240, 1);
}

TEST(SpindleCamera, DrawsNoTargetFromItsBackNorBehindTheCamera) {
  SpindlePicture picture = PlainPicture();
  PlacedTarget back = TargetAt(0, 0, 0);
  back.camera_from_target.turn = TurnZ(0.1);  // its z points away from the camera
  PlacedTarget behind = TargetAt(0, 0, 0);
  behind.camera_from_target.origin_mm[2] = -300;
  picture.targets = {back, behind};
  const Page page = Taken(picture);
  EXPECT_EQ(*std::max_element(page.samples.begin(), page.samples.end()), 20);
}

TEST(SpindleCamera, OneSeedIsOnePicture) {
  SpindlePicture picture = PlainPicture();
  picture.targets = {TargetAt(2, 3, 0.1)};
  picture.clutter = ShopClutter();
  picture.clutter.over_targets = true;
  picture.eye = {};
  EXPECT_EQ(TakePicture(picture, Random(1))->samples, TakePicture(picture, Random(1))->samples);
  EXPECT_NE(TakePicture(picture, Random(1))->samples, TakePicture(picture, Random(2))->samples);
}

TEST(SpindleCamera, RefusesByName) {
  using ::testing::HasSubstr;
  const auto why = [](const SpindlePicture& picture) {
    const auto page = TakePicture(picture, Random(1));
    return page ? std::string() : page.error().message;
  };
  SpindlePicture picture = PlainPicture();
  picture.eye.blur_px = std::numeric_limits<double>::quiet_NaN();
  EXPECT_THAT(why(picture), HasSubstr("blur_px is nan"));
  picture = PlainPicture();
  picture.targets = {TargetAt(0, 0, 0)};
  picture.targets[0].pattern.bits = 40;
  EXPECT_THAT(why(picture), HasSubstr("40 segments"));
  picture.targets[0].pattern.bits = 12;
  picture.targets[0].pattern.ring_inner_mm = 1;
  EXPECT_THAT(why(picture), HasSubstr("must rise"));
}

}  // namespace
}  // namespace trammel::sim
