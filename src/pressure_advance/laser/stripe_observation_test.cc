#include "pressure_advance/laser/stripe_observation.h"

#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <cstdlib>
#include <opencv2/core.hpp>
#include <opencv2/imgcodecs.hpp>
#include <string>
#include <utility>
#include <vector>

#include "pressure_advance/laser/laser_reader.h"
#include "support/sweep_world.h"

namespace trammel::pressure_advance {
namespace {

using test::LaserWorld;
using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::IsEmpty;

constexpr double kPxPerMm = 44;

StripeObservation See(const LaserWorld& world, std::uint64_t seed) {
  Random random(seed);
  std::vector<Frame> frames;
  std::vector<BgrView> views;
  for (int i = 0; i < 8; ++i) frames.push_back(DrawLaserFrame(world, 0.11, random));
  for (const Frame& frame : frames) views.push_back(frame.view());
  return SeeStripe(views);
}

std::vector<std::string> Notices(const LaserWorld& world, std::uint64_t seed) {
  const std::vector<StripeObservation> sweeps(10, See(world, seed));
  return ObservationNotices(sweeps, kPxPerMm);
}

TEST(StripeObservation, TellsWidthAndHeightOfALineThatWasDrawn) {
  LaserWorld world;
  world.width = 90;
  world.plate_column_px = 55;
  for (const double sigma_px : {1.2, 2.0, 4.0, 7.0}) {
    world.stripe_sigma_px = sigma_px;
    const StripeObservation observation = See(world, 1);
    // A parabola's top is cut between two pixels; speckle of 0.25 is averaged over 190 rows.
    EXPECT_NEAR(observation.width_px, 2.355 * sigma_px, 0.05 * 2.355 * sigma_px + 0.2) << sigma_px;
    EXPECT_NEAR(observation.peak, world.plate_amplitude, 12) << sigma_px;
  }
}

TEST(StripeObservation, GoodLinesGetNoNotice) {
  LaserWorld world;
  world.width = 60;
  for (const double sigma_px : {1.5, 2.5, 4.0}) {
    for (const double amplitude : {80.0, 150.0, 240.0, 300.0}) {
      world.stripe_sigma_px = sigma_px;
      world.plate_amplitude = amplitude;
      EXPECT_THAT(Notices(world, 3), IsEmpty()) << sigma_px << " px, " << amplitude;
    }
  }
}

TEST(StripeObservation, EachFaultIsNamedWithItsFigureAndRemedy) {
  LaserWorld blurred;
  blurred.width = 110;
  blurred.plate_column_px = 60;
  blurred.stripe_sigma_px = 9;
  blurred.plate_amplitude = 120;
  EXPECT_THAT(Notices(blurred, 4),
              ElementsAre(testing::AllOf(HasSubstr("out of focus: 2"), HasSubstr("mm) wide"),
                                         HasSubstr("focus_height"))));
  LaserWorld burnt;
  burnt.stripe_sigma_px = 3;
  burnt.plate_amplitude = 2000;
  EXPECT_THAT(Notices(burnt, 5), ElementsAre(testing::AllOf(HasSubstr("overexposed"),
                                                            HasSubstr("lower the camera's"))));
  LaserWorld dim;
  dim.plate_amplitude = 25;
  EXPECT_THAT(Notices(dim, 6),
              ElementsAre(testing::AllOf(HasSubstr("is dim: 2"), HasSubstr("raise the camera's"))));
  LaserWorld off;
  off.plate_amplitude = off.bead_amplitude = 0;
  EXPECT_EQ(See(off, 7).width_px, 0);
  EXPECT_THAT(Notices(off, 7), IsEmpty());  // the sweep itself reports a missing line
}

TEST(StripeObservation, ALineAsWideAsThePictureIsNoMissingLaser) {
  EXPECT_EQ(FaultOfWidth({14, 180, 3}, 45), "");
  EXPECT_THAT(FaultOfWidth({24, 180, 5}, 45),
              testing::AllOf(HasSubstr("24 px wide"), HasSubstr("45 px"), HasSubstr("focus")));
  EXPECT_THAT(FaultOfWidth({24, 240, 20}, 45), HasSubstr("overexposed"));
}

// Recorded frames (SOURCES.md beside them), the line on the plate. Their widths were read by eye.
TEST(StripeObservation, RecordedLinesAreSeenAndNoneIsBlamed) {
  const char* folder = std::getenv("TRAMMEL_TEST_DATA");
  if (folder == nullptr) GTEST_SKIP() << "set TRAMMEL_TEST_DATA to the folder with laser/";
  struct Recorded {
    const char* file;
    PixelRect part;
    double width_px;
  };
  for (const Recorded& one : {Recorded{"cropped.png", {0, 0, 45, 60}, 6.5},
                              Recorded{"laser_thick.jpg", {460, 445, 80, 100}, 9},
                              Recorded{"plates.jpg", {690, 0, 60, 340}, 8},
                              Recorded{"plates.jpg", {690, 400, 80, 100}, 10}}) {
    const cv::Mat picture = cv::imread(std::string(folder) + "/laser/" + one.file);
    ASSERT_FALSE(picture.empty()) << one.file;
    Frame frame(one.part.width, one.part.height);
    for (int y = 0; y < one.part.height; ++y) {
      std::copy_n(picture.ptr<std::uint8_t>(one.part.y + y) + 3 * one.part.x, 3 * one.part.width,
                  frame.row(y));
    }
    const BgrView view = frame.view();
    const StripeObservation observation = SeeStripe({&view, 1});
    EXPECT_NEAR(observation.width_px, one.width_px, 0.2 * one.width_px) << one.file;
    EXPECT_THAT(ObservationNotices({&observation, 1}, kPxPerMm), IsEmpty()) << one.file;
  }
}

TEST(FindCrop, RefusesAPictureThatIsTooSmallForALaserLineByItsSize) {
  vision::LaserLineWorkspace workspace;
  for (const auto& [width, height] : {std::pair{1, 1}, {4, 4}, {7, 480}, {15, 480}, {640, 1}}) {
    const std::vector<Frame> frames(3, Frame(width, height));
    for (const AxisDirection direction : {AxisDirection::kMinusX, AxisDirection::kPlusY}) {
      const FoundCrop found = FindCrop(frames, direction, workspace);
      EXPECT_FALSE(found.crop) << width << "x" << height;
      // Size as in the video: frames are rotated upright.
      EXPECT_THAT(found.fault, HasSubstr(direction == AxisDirection::kMinusX
                                             ? fmt::format("{}x{} px", width, height)
                                             : fmt::format("{}x{} px", height, width)));
    }
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
