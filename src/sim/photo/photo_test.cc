#include "sim/photo/photo.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <initializer_list>
#include <utility>
#include <vector>

#include "sim/laser/laser_test_support.h"

namespace trammel::sim {
namespace {

PhotoTraits SmallPhoto() {
  PhotoTraits traits;
  traits.scene = {PhotoFilament::kBlack, PhotoPlate::kLight};
  traits.width_px = 300;
  traits.height_px = 400;
  return traits;
}

Bed ThreeBeads() {
  Bed bed = StraightBead(100, 120, 100, 0.8, 0.3);
  for (const double y : {110.0, 125.0}) {
    bed.strands.push_back(StraightBead(100, 120, y, 0.8, 0.3).strands[0]);
  }
  return bed;
}

// First and last dark pixel's edges of a black bead in a column, to sub-pixel, near a row.
std::pair<double, double> DarkEdges(const Frame& frame, int column, double near_row) {
  const auto grey = [&](int row) {
    const std::uint8_t* p = frame.view().row(row) + std::ptrdiff_t{3} * column;
    return (p[0] + p[1] + p[2]) / 3.0;
  };
  const int centre = static_cast<int>(std::lround(near_row));
  double dark = grey(centre);  // the top shines: the flanks tell how dark the filament is
  for (int row = centre - 6; row <= centre + 6; ++row) dark = std::min(dark, grey(row));
  const double bright = grey(centre - 14);
  const double half = (dark + bright) / 2;
  int up = centre;
  while (up > 0 && grey(up) < half) --up;
  int down = centre;
  while (down < frame.height - 1 && grey(down) < half) ++down;
  const double first = up + (grey(up) - half) / (grey(up) - grey(up + 1));
  const double last = down - (grey(down) - half) / (grey(down) - grey(down - 1));
  return {first, last};
}

TEST(PhotoCamera, RayAndProjectionAreInverse) {
  Random random(3);
  for (int i = 0; i < 50; ++i) {
    const PhotoTraits traits =
        DrawPhotoTraits({PhotoFilament::kNatural, PhotoPlate::kDark}, random);
    const PhotoCamera camera(traits, {100, 80, 130, 140});
    const double x = random.Uniform(0, traits.width_px);
    const double y = random.Uniform(0, traits.height_px);
    const Vector3 ray = camera.Ray(x, y);
    const double fall = camera.position().z - 0.2;
    const ImagePoint seen = camera.Project(
        {camera.position().x + ray.x * fall, camera.position().y + ray.y * fall, 0.2});
    EXPECT_NEAR(seen.x_px, x, 1e-5);
    EXPECT_NEAR(seen.y_px, y, 1e-5);
  }
}

TEST(PhotoCamera, LooksUprightAndFurtherAwayIsSmaller) {
  PhotoTraits traits;
  traits.tilt_rad = 0.3;
  traits.tilt_towards_rad = -1.5707963267949;  // the camera stands on the near side
  const PhotoCamera camera(traits, {100, 80, 130, 140});
  const auto width = [&](double y) {
    return camera.Project({130, y, 0}).x_px - camera.Project({100, y, 0}).x_px;
  };
  EXPECT_GT(width(80), 1.05 * width(140));
  EXPECT_LT(width(140) > 0 ? camera.Project({115, 140, 0}).y_px : 1e9,
            camera.Project({115, 80, 0}).y_px);
}

TEST(Photo, BeadEdgesLieWhereTheCameraProjectsThem) {
  PhotoTraits traits = SmallPhoto();
  traits.roll_rad = 0.01;
  traits.light_elevation_rad = 1.5;  // no shadow beside the bead
  traits.focal_heights = 5;          // large distance: a bead's flank hides nothing
  const Bed bed = ThreeBeads();
  const Result<Frame> photo = RenderPhoto(bed, traits, Random(1));
  ASSERT_TRUE(photo) << photo.error().message;
  const PhotoCamera camera(traits, *PrintedRegion(bed));
  // The contract of RenderPhoto.
  constexpr double kTolerancePx = 0.25;
  for (const double y : {100.0, 110.0, 125.0}) {
    const ImagePoint upper = camera.Project({110, y + 0.4, 0});
    const ImagePoint lower = camera.Project({110, y - 0.4, 0});
    const int column = static_cast<int>(std::lround(upper.x_px));
    const double sway = 0.01 * (column - upper.x_px);
    const auto [first, last] = DarkEdges(*photo, column, (upper.y_px + lower.y_px) / 2);
    EXPECT_NEAR(first, upper.y_px - sway, kTolerancePx) << y;
    EXPECT_NEAR(last, lower.y_px - sway, kTolerancePx) << y;
  }
}

// Beads along the bed's axis, each a little wider than the one before.
TEST(Photo, BeadsAreAsWideAsTheyWerePrinted) {
  PhotoTraits traits = SmallPhoto();
  traits.scene.matte = true;
  traits.light_elevation_rad = 1.5;
  traits.focal_heights = 5;
  constexpr double kStep_mm = 0.0125;  // half of a cell of the height field
  Bed bed = StraightBead(100, 112, 100, 0.4, 0.2);
  for (int i = 1; i < 8; ++i) {
    const double width = 0.4 + kStep_mm * i;
    bed.strands.push_back(StraightBead(100, 112, 100 + 2 * i, width, 0.2).strands[0]);
  }
  const Result<Frame> photo = RenderPhoto(bed, traits, Random(1));
  ASSERT_TRUE(photo) << photo.error().message;
  const PhotoCamera camera(traits, *PrintedRegion(bed));
  const double px_per_mm =
      camera.Project({112, 107, 0}).x_px / 12 - camera.Project({100, 107, 0}).x_px / 12;
  std::vector<double> widths_mm;
  for (int i = 0; i < 8; ++i) {
    constexpr int kReach = 11;
    std::array<double, 2 * kReach + 1> level{};  // across the bead
    for (int step = 0; step < 200; ++step) {
      const ImagePoint at = camera.Project({101 + 0.05 * step, 100.0 + 2 * i, 0});
      for (int row = -kReach; row <= kReach; ++row) {
        const std::uint8_t* p = photo->view().row(static_cast<int>(std::lround(at.y_px)) + row) +
                                std::ptrdiff_t{3} * std::lround(at.x_px);
        level[static_cast<std::size_t>(row + kReach)] += p[0] + p[1] + p[2];
      }
    }
    const double plate = (level.front() + level.back()) / 2;
    const double filament = *std::ranges::min_element(level);
    double sum_px = 0;
    for (const double value : level) sum_px += (plate - value) / (plate - filament);
    widths_mm.push_back(sum_px / px_per_mm);
  }
  for (std::size_t i = 1; i < widths_mm.size(); ++i) {
    EXPECT_NEAR(widths_mm[i] - widths_mm[i - 1], kStep_mm, kStep_mm / 2) << i;
  }
}

TEST(Photo, EqualSeedsGiveEqualPicturesAndOthersDiffer) {
  const auto render = [](std::uint64_t seed) {
    Random random(seed);
    PhotoTraits traits = DrawPhotoTraits({}, random);
    traits.width_px = 120;
    traits.height_px = 200;
    return RenderPhoto(ThreeBeads(), traits, random)->bgr;
  };
  EXPECT_EQ(render(11), render(11));
  EXPECT_NE(render(11), render(12));
}

TEST(Photo, TraitsByNameDarkenBrightenAndHide) {
  const auto grey = [](std::initializer_list<std::pair<const char*, double>> settings, double x,
                       double y) {
    PhotoTraits traits = SmallPhoto();
    traits.scene.plate = PhotoPlate::kGlass;
    for (const auto& [name, value] : settings) {
      EXPECT_TRUE(SetNamed(kPhotoNumbers, {name, value}, traits).value_or(false)) << name;
    }
    Result<Frame> photo = RenderPhoto(ThreeBeads(), traits, Random(1));
    EXPECT_TRUE(photo);
    if (!photo) return 0;
    const auto column = static_cast<int>((0.5 + x) * photo->width);
    return int{photo->row(static_cast<int>((0.5 + y) * photo->height))[3 * column + 1]};
  };
  const int plain = grey({}, -0.45, 0.02);
  const int far = grey({}, 0.45, 0.02);
  EXPECT_LT(grey({{"hand", 0.1}}, 0.45, 0.02), far + 10);
  EXPECT_GT(grey({{"hand", 0.1}}, 0.45, 0.02), far - 10);
  EXPECT_GT(std::abs(grey({{"hand", 0.1}}, -0.45, 0.02) - plain), 15);
  EXPECT_GT(grey({{"glare", 1}, {"glare-x", 0}, {"glare-y", 0.02}}, 0, 0.02),
            grey({}, 0, 0.02) + 50);
  // The shadow's edge is 0.2 heights right of the middle.
  const auto shadow = [&](double x) {
    return grey({{"shadow", 0.5}, {"shadow-offset", 0.1}, {"shadow-softness", 0.01}}, x, 0.02);
  };
  EXPECT_NEAR(shadow(-0.45), plain, 10);
  EXPECT_NEAR(shadow(0.45), far / 2, 10);
  EXPECT_NEAR(
      grey({{"shadow", 0.5}, {"shadow-azimuth-deg", 180}, {"shadow-offset", 0.1}}, 0.45, 0.02), far,
      10);
}

}  // namespace
}  // namespace trammel::sim
