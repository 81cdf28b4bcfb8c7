#include "sim/spindle/spindle_camera.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
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
  picture.optics = {.blur_px = 0, .read_noise = 0, .shot_noise = 0};
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

TEST(SpindleCamera, NoiseGrowsWithTheLightAsShotNoiseDoes) {
  SpindlePicture picture = PlainPicture();
  picture.optics.read_noise = 2;
  picture.optics.shot_noise = 0.04;
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

}  // namespace
}  // namespace trammel::sim
