#include "pressure_advance/laser/laser_reader.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <numeric>
#include <optional>
#include <vector>

#include "base/statistics.h"
#include "support/sweep_world.h"

namespace trammel::pressure_advance {
namespace {

using test::DrawLaserFrame;
using test::LaserWorld;
using ::testing::HasSubstr;

Scan PaperScan() {
  Scan scan;
  scan.lines.resize(1);
  scan.lines[0].pressure_advance_s = 0.02;
  scan.lines[0].video = "line.avi";
  scan.scan_speed_mm_s = 20.0 / 3;
  scan.px_per_mm = 44;
  scan.line_start_mm = 4;
  scan.motion = {
      .segments = {{0.25, 5}, {0.5, 150}, {0.25, 5}}, .length_mm = 30, .acceleration_mm_s2 = 3000};
  return scan;
}

SweepReading Read(const std::vector<Frame>& frames, const Scan& scan) {
  vision::LaserLineWorkspace workspace;
  return ReadSweep(frames, scan, scan.lines[0], {}, workspace);
}

/// Areas from starved to overfed and a break, in steps of ten frames.
const std::vector<double> kAreas{0.10, 0.06, 0.03, 0.0, 0.10, 0.13, 0.16, 0.20, 0.10, 0.10};

std::vector<Frame> DrawSteps(const LaserWorld& world, Random& random) {
  std::vector<Frame> frames;
  for (const double area : kAreas) {
    for (int i = 0; i < 10; ++i) {
      frames.push_back(DrawLaserFrame(world, area, random));
    }
  }
  return frames;
}

/// Mean reading of step i over its ten frames.
double StepMean(const LineProfile& profile, std::size_t i) {
  double sum = 0;
  for (std::size_t k = 10 * i; k < 10 * (i + 1); ++k) {
    sum += profile.samples[k].area.value / 10;
  }
  return sum;
}

TEST(LaserReader, AreaIsLinearInTheFilamentFromABreakToTwiceTheNominal) {
  LaserWorld wide;
  wide.stripe_sigma_px = 3.5;
  wide.width = 70;
  wide.plate_column_px = 52;
  LaserWorld tilted;
  tilted.tilt = 0.08;
  tilted.bead_row_px = 25;
  LaserWorld bright;
  bright.bead_amplitude = 260;
  LaserWorld coarse;
  coarse.px_per_mm = 30;
  for (const LaserWorld& world : {LaserWorld{}, wide, tilted, bright, coarse}) {
    Random random(11);
    Scan scan = PaperScan();
    scan.px_per_mm = world.px_per_mm;
    const SweepReading reading = Read(DrawSteps(world, random), scan);
    ASSERT_EQ(reading.profile.unusable, "");
    ASSERT_EQ(reading.profile.samples.size(), 100U);
    const double gain = StepMean(reading.profile, 0) / kAreas[0];
    // A stripe some rows wide cannot quite follow a parabola's foot.
    EXPECT_NEAR(gain, 1, 0.2);
    for (std::size_t i = 0; i < kAreas.size(); ++i) {
      // 6 % of the nominal area moves a pressure advance by less than 2 ms per ten frames.
      EXPECT_NEAR(StepMean(reading.profile, i) / gain, kAreas[i], 0.006)
          << "step " << i << ", sigma " << world.stripe_sigma_px << ", tilt " << world.tilt;
    }
  }
}

TEST(LaserReader, ABreakIsAnAreaOfZeroAndADarkFrameIsAGap) {
  Random random(12);
  const LaserWorld world;
  std::vector<Frame> frames = DrawSteps(world, random);
  std::fill(frames[55].bgr.begin(), frames[55].bgr.end(), std::uint8_t{5});
  const SweepReading reading = Read(frames, PaperScan());
  ASSERT_EQ(reading.profile.unusable, "");
  for (std::size_t i = 31; i < 39; ++i) {
    EXPECT_FALSE(reading.profile.samples[i].gap);
    EXPECT_TRUE(reading.profile.samples[i].area.seen());
    EXPECT_NEAR(reading.profile.samples[i].area.value, 0, 0.01);
  }
  EXPECT_TRUE(reading.profile.samples[55].gap);
  EXPECT_FALSE(reading.profile.samples[55].area.seen());
}

TEST(LaserReader, PredictsTheScatterOfItsAreas) {
  std::vector<double> pulls;
  for (const std::uint64_t seed : {21, 22, 23, 24}) {
    Random random(seed);
    std::vector<Frame> frames;
    for (int i = 0; i < 100; ++i) {
      frames.push_back(DrawLaserFrame({}, 0.11, random));
    }
    const SweepReading reading = Read(frames, PaperScan());
    ASSERT_EQ(reading.profile.unusable, "");
    std::vector<double> areas;
    for (const ProfileSample& sample : reading.profile.samples) {
      areas.push_back(sample.area.value);
    }
    const double mean = Mean(areas);
    for (const ProfileSample& sample : reading.profile.samples) {
      pulls.push_back((sample.area.value - mean) / sample.area.sigma);
    }
  }
  // 400 samples tell 1 from 1 +- 0.035; the noise's own scale is found from each sweep to 10 %.
  EXPECT_GT(StandardDeviation(pulls), 0.6);
  EXPECT_LT(StandardDeviation(pulls), 1.3);
}

TEST(LaserReader, ReadsTheSameWhicheverWayThePictureIsTurned) {
  Random random(13);
  const std::vector<Frame> frames = DrawSteps({}, random);
  const SweepReading original = Read(frames, PaperScan());
  for (const AxisDirection direction :
       {AxisDirection::kPlusX, AxisDirection::kMinusY, AxisDirection::kPlusY}) {
    const bool mirror = direction == AxisDirection::kPlusX || direction == AxisDirection::kPlusY;
    const bool transpose = direction != AxisDirection::kPlusX;
    std::vector<Frame> turned;
    for (const Frame& frame : frames) {
      Frame image = frame;
      for (int y = 0; mirror && y < frame.height; ++y) {
        for (int x = 0; x < frame.width; ++x) {
          std::copy_n(frame.view().row(y) + std::ptrdiff_t{3} * x, 3,
                      image.row(y) + std::ptrdiff_t{3} * (frame.width - 1 - x));
        }
      }
      Frame recorded;  // transposed by the camera, turned back by the eye's own seam
      TurnUpright(image.view(), transpose ? AxisDirection::kMinusY : AxisDirection::kMinusX,
                  recorded);
      turned.emplace_back();
      TurnUpright(recorded.view(), direction, turned.back());
    }
    Scan scan = PaperScan();
    scan.height_direction = direction;
    const SweepReading reading = Read(turned, scan);
    ASSERT_EQ(reading.profile.unusable, "");
    for (std::size_t i = 0; i < 100; ++i) {
      EXPECT_NEAR(reading.profile.samples[i].area.value, original.profile.samples[i].area.value,
                  0.004);
    }
  }
}

TEST(LaserReader, LeavesOutFramesBeforeTheLaserMoves) {
  Random random(14);
  std::vector<Frame> frames = DrawSteps({}, random);
  frames.insert(frames.begin(), 7, frames[0]);
  const SweepReading reading = Read(frames, PaperScan());
  ASSERT_EQ(reading.profile.unusable, "");
  EXPECT_EQ(reading.still_frames, 7U);
  EXPECT_DOUBLE_EQ(reading.profile.samples[0].position, 4);
  EXPECT_EQ(reading.profile.samples.size(), 100U);
}

TEST(LaserReader, RunsPositionsBackwardsForAnOppositeSweep) {
  Random random(15);
  const std::vector<Frame> frames = DrawSteps({}, random);
  for (const double start_mm : {26.0, 4.0}) {  // the second only makes sense from the far end
    Scan scan = PaperScan();
    scan.line_start_mm = start_mm;
    scan.lines[0].sweep_direction = AxisDirection::kMinusX;
    const SweepReading reading = Read(frames, scan);
    ASSERT_EQ(reading.profile.unusable, "");
    EXPECT_NEAR(reading.profile.samples.back().position, 26, 1e-9);
    EXPECT_NEAR(reading.profile.samples.front().position, 26 - 22, 1e-6);
    // Frame 75 lies in the fattest step; in print order it is the 25th from the front.
    EXPECT_GT(reading.profile.samples[24].area.value, 0.15);
  }
}

/// Positions of the 100 frames of DrawSteps as PaperScan() has them.
std::vector<std::optional<double>> PaperPositions() {
  std::vector<std::optional<double>> positions;
  for (int i = 0; i < 100; ++i) {
    positions.emplace_back(4 + i / 30.0 * 20 / 3);
  }
  return positions;
}

TEST(LaserReader, GivenPositionsReadLikeTheSameFromTimesAndOutrankThem) {
  constexpr double kRounding_mm = 1e-12;  // adding times differs from multiplying by less
  Random random(20);
  const std::vector<Frame> frames = DrawSteps({}, random);
  Scan scan = PaperScan();
  const SweepReading from_times = Read(frames, scan);
  scan.lines[0].frame_positions_mm = PaperPositions();
  scan.line_start_mm = 11;
  scan.lines[0].sweep_direction = AxisDirection::kMinusX;
  for (int i = 0; i < 100; ++i) scan.lines[0].frame_times_s.push_back(0.01 * i);
  const SweepReading given = Read(frames, scan);
  ASSERT_EQ(given.profile.unusable, "");
  ASSERT_EQ(given.profile.samples.size(), from_times.profile.samples.size());
  for (std::size_t i = 0; i < given.profile.samples.size(); ++i) {
    const ProfileSample& a = given.profile.samples[i];
    const ProfileSample& b = from_times.profile.samples[i];
    EXPECT_NEAR(a.position, b.position, kRounding_mm);
    EXPECT_EQ(a.area.value, b.area.value) << i;
    EXPECT_EQ(a.area.sigma, b.area.sigma) << i;
  }
  EXPECT_EQ(given.frame, from_times.frame);
}

TEST(LaserReader, TooFewPositionsAndAFrozenPictureAreUnusable) {
  Random random(27);
  std::vector<Frame> frames = DrawSteps({}, random);
  Scan scan = PaperScan();
  scan.lines[0].frame_positions_mm.resize(100);
  scan.lines[0].frame_positions_mm[50] = 14;
  scan.lines[0].frame_positions_mm[51] = 15;
  EXPECT_THAT(Read(frames, scan).profile.unusable,
              testing::AllOf(HasSubstr("only 2 of 100"), HasSubstr("98 without a position"),
                             HasSubstr("check frame_positions_mm")));
  scan.lines[0].frame_positions_mm = PaperPositions();
  scan.lines[0].frame_positions_mm[0].reset();  // the only frame that differs
  std::fill(frames.begin() + 1, frames.end(), frames[1]);
  EXPECT_THAT(Read(frames, scan).profile.unusable, HasSubstr("all 99 frames are the same picture"));
}

TEST(LaserReader, SaysWhyASweepIsUnusable) {
  const Scan scan = PaperScan();
  for (const int level : {0, 255}) {
    std::vector<Frame> frames(40, Frame(45, 60));
    Random random(17);
    for (Frame& frame : frames) {
      for (std::uint8_t& value : frame.bgr) {
        value = static_cast<std::uint8_t>(
            std::clamp<int>(level + static_cast<int>(random.Below(3)) - 1, 0, 255));
      }
    }
    EXPECT_THAT(Read(frames, scan).profile.unusable, HasSubstr("no laser line")) << level;
  }
  Random random(18);
  LaserWorld off;
  off.plate_amplitude = 0;
  off.bead_amplitude = 0;
  off.noise = 6;
  off.ambient = 60;
  EXPECT_THAT(Read(DrawSteps(off, random), scan).profile.unusable, HasSubstr("no laser line"));
  std::vector<Frame> flat;
  for (int i = 0; i < 60; ++i) {
    flat.push_back(DrawLaserFrame({}, 0, random));
  }
  EXPECT_THAT(Read(flat, scan).profile.unusable, HasSubstr("no bead"));
  const std::vector<Frame> frozen(50, flat[0]);
  EXPECT_THAT(Read(frozen, scan).profile.unusable, HasSubstr("same picture"));
  flat.resize(5);
  EXPECT_THAT(Read(flat, scan).profile.unusable, HasSubstr("only 5 of 5"));
}

/// A nominal bead that swells to so many times its area about frame 60, and back.
std::vector<double> SwellAreas(double times, double frames) {
  std::vector<double> areas;
  for (int f = 0; f < 100; ++f) {
    const double t = (f - 60) / frames;
    areas.push_back(0.1 * (1 + (times - 1) * std::exp(-0.5 * t * t)));
  }
  return areas;
}

TEST(LaserReader, ReadsASwellWholeOrSaysThatItIsCutOff) {
  LaserWorld paper;
  LaserWorld large;
  large.width = 80;
  large.height = 110;
  large.plate_column_px = 65;
  large.bead_row_px = 52;
  LaserWorld flat = large;  // surplus material spreads sideways
  flat.highest_mm = 0.35;
  flat.tilt = -0.06;
  Scan scan;
  scan.lines.resize(1);
  scan.scan_speed_mm_s = 20.0 / 3;
  scan.px_per_mm = 44;
  scan.line_start_mm = 4;
  scan.motion.length_mm = 30;
  vision::LaserLineWorkspace workspace;
  for (const LaserWorld& world : {paper, large, flat}) {
    for (const double frames : {2.0, 8.0}) {
      for (const double times : {0.2, 2.0, 4.1, 6.0, 12.0}) {
        Random random(41);
        const std::vector<double> areas = SwellAreas(times, frames);
        std::vector<Frame> drawn;
        for (const double area : areas) drawn.push_back(DrawLaserFrame(world, area, random));
        const SweepReading reading = ReadSweep(drawn, scan, scan.lines[0], {}, workspace);
        const std::vector<ProfileSample>& samples = reading.profile.samples;
        const auto what = testing::Message()
                          << times << " areas over " << frames << " frames, " << world.height
                          << " rows, " << world.highest_mm << " mm, tilt " << world.tilt;
        ASSERT_EQ(reading.profile.unusable, "") << what;
        ASSERT_EQ(samples.size(), areas.size()) << what;
        double base = 0;
        for (std::size_t f = 5; f < 25; ++f) base += samples[f].area.value / 20;
        std::size_t cut_off = 0;
        double error = 0;  // of the sum over the bulge
        double sum = 0;
        for (std::size_t f = 0; f < samples.size(); ++f) {
          EXPECT_EQ(samples[f].gap, samples[f].cut_off) << what;
          cut_off += samples[f].cut_off;
          if (samples[f].gap) continue;
          const double expected = base * areas[f] / areas[0];
          // A stripe some rows wide cannot quite follow a section's foot.
          EXPECT_NEAR(samples[f].area.value, expected, 0.04 * expected + 0.006)
              << what << ", frame " << f;
          error += samples[f].area.value - expected;
          sum += expected;
        }
        EXPECT_NEAR(error, 0, 0.02 * sum) << what;
        EXPECT_EQ(reading.cut_off_frames, cut_off) << what;
        // Dimensions of the largest section.
        const double height_mm = std::min(std::sqrt(0.075 * times), world.highest_mm);
        const double half_px = 44 * 0.075 * times / height_mm;
        const double rise_px = 44 * height_mm;
        const bool fits = half_px < world.bead_row_px - 6 && rise_px < world.plate_column_px - 6;
        if (fits) {
          EXPECT_EQ(cut_off, 0U) << what;
        }
        // A few rows of its foot are less than is noticed, and than is told.
        if (half_px > world.bead_row_px + 6 || rise_px > world.plate_column_px) {
          EXPECT_TRUE(samples[60].cut_off) << what;
        }
      }
    }
  }
}

TEST(SharedScatter, DrawsSigmasHalfWayToTheScans) {
  constexpr double kExact = 1e-12;
  std::vector<LineProfile> lines(3);
  const double sigmas[3][3] = {{1, 1, 1}, {2, 2, 2}, {1.5, 2, 3}};
  for (std::size_t i = 0; i < 9; ++i) {
    lines[i / 3].samples.emplace_back().area = {0.1, sigmas[i / 3][i % 3]};
  }
  ShareScatter(lines);
  EXPECT_NEAR(lines[0].samples[0].area.sigma, std::sqrt(2), kExact);
  EXPECT_NEAR(lines[1].samples[0].area.sigma, 2, kExact);
  EXPECT_NEAR(lines[2].samples[2].area.sigma, std::sqrt(6), kExact);
  EXPECT_EQ(lines[0].samples[0].area.value, 0.1);
}

}  // namespace
}  // namespace trammel::pressure_advance
