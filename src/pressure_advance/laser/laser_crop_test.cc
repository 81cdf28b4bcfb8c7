#include "pressure_advance/laser/laser_crop.h"

#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <utility>
#include <vector>

#include "pressure_advance/laser/laser_eye.h"
#include "support/laser_world.h"

namespace trammel::pressure_advance {
namespace {

using ::testing::HasSubstr;

TEST(FindCrop, RefusesAPictureThatIsTooSmallForALaserLineByItsSize) {
  vision::LaserLineWorkspace workspace;
  for (const auto& [width, height] : {std::pair{1, 1}, {4, 4}, {7, 480}, {15, 480}, {640, 1}}) {
    const std::vector<Frame> frames(3, Frame(width, height));
    for (const AxisDirection direction : {AxisDirection::kMinusX, AxisDirection::kPlusY}) {
      const FoundCrop found = FindCrop(frames, direction, workspace);
      EXPECT_FALSE(found.crop) << width << "x" << height;
      // As the video has it: frames are turned upright.
      EXPECT_THAT(found.fault, HasSubstr(direction == AxisDirection::kMinusX
                                             ? fmt::format("{}x{} px", width, height)
                                             : fmt::format("{}x{} px", height, width)));
    }
  }
}

TEST(FindCrop, FindsNoLaserLineInADarkPicture) {
  vision::LaserLineWorkspace workspace;
  for (const int size : {16, 17, 64}) {
    const std::vector<Frame> frames(3, Frame(size, size));
    EXPECT_FALSE(FindCrop(frames, AxisDirection::kMinusX, workspace).crop) << size;
  }
}

TEST(FindCrop, HoldsASwellOfSixAreasWithPlateBesideIt) {
  test::LaserWorld world;
  world.width = 160;
  world.height = 200;
  world.plate_column_px = 120;
  world.bead_row_px = 104;
  for (const double highest_mm : {1.0, 0.4}) {
    world.highest_mm = highest_mm;
    Random random(42);
    std::vector<Frame> frames;
    Scan scan;
    scan.lines.resize(1);
    scan.scan_speed_mm_s = 20.0 / 3;
    scan.px_per_mm = 44;
    scan.line_start_mm = 0;
    scan.motion.length_mm = 30;
    for (int f = 0; f < 60; ++f) {
      const double t = (f - 40) / 3.0;
      frames.push_back(test::DrawLaserFrame(world, 0.1 * (1 + 5 * std::exp(-0.5 * t * t)), random));
    }
    std::vector<Frame> sample;  // none of the swell
    for (std::size_t f = 0; f < 30; f += 3) sample.push_back(frames[f]);
    vision::LaserLineWorkspace workspace;
    const FoundCrop found = FindCrop(sample, scan.height_direction, workspace);
    ASSERT_TRUE(found.crop) << found.fault;
    std::vector<Frame> cropped(frames.size());
    for (std::size_t f = 0; f < frames.size(); ++f) {
      TurnUpright(Crop(frames[f].view(), *found.crop), scan.height_direction, cropped[f]);
    }
    const SweepReading reading = ReadSweep(cropped, scan, scan.lines[0], {}, workspace);
    ASSERT_EQ(reading.profile.unusable, "");
    EXPECT_EQ(reading.cut_off_frames, 0U) << highest_mm;
    const double nominal = reading.profile.samples[5].area.value;
    EXPECT_NEAR(reading.profile.samples[40].area.value / nominal, 6, 0.04 * 6) << highest_mm;
  }
}

}  // namespace
}  // namespace trammel::pressure_advance
