// Beads that swell beyond what the rest of their sweep covers.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <vector>

#include "pressure_advance/laser/laser_eye.h"
#include "support/laser_world.h"

namespace trammel::pressure_advance {
namespace {

using test::DrawLaserFrame;
using test::LaserWorld;

/// A nominal bead that swells to so many times its area about frame 60, and back.
std::vector<double> SwellAreas(double times, double frames) {
  std::vector<double> areas;
  for (int f = 0; f < 100; ++f) {
    const double t = (f - 60) / frames;
    areas.push_back(0.1 * (1 + (times - 1) * std::exp(-0.5 * t * t)));
  }
  return areas;
}

TEST(LaserEye, ReadsASwellWholeOrSaysThatItIsCutOff) {
  LaserWorld paper;
  LaserWorld large;
  large.width = 80;
  large.height = 110;
  large.plate_column_px = 65;
  large.bead_row_px = 52;
  LaserWorld flat = large;  // what is squeezed out goes sideways
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
        double error = 0;  // of the sum over the swell
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
        // Of the largest section.
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

}  // namespace
}  // namespace trammel::pressure_advance
