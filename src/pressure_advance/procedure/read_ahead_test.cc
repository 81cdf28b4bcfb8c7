#include "pressure_advance/procedure/read_ahead.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <fstream>
#include <vector>

#include "support/laser_world.h"

namespace trammel::procedure {
namespace {

using pressure_advance::Scan;
using pressure_advance::ScanLine;
using pressure_advance::SweepReading;

constexpr int kFrames = 60;
constexpr int kStanding = 5;

class ReadAheadTest : public ::testing::Test {
 protected:
  ReadAheadTest() {
    scan_.scan_speed_mm_s = 10;
    scan_.px_per_mm = 44;
    scan_.line_start_mm = 4;
    scan_.motion = {.segments = {{0.25, 5}, {0.5, 150}, {0.25, 5}},
                    .length_mm = 30,
                    .acceleration_mm_s2 = 3000};
    scan_.crop = PixelRect{145, 90, 45, 60};
    scan_.lines.resize(1);
    scan_.lines[0].video = "line0.avi";
    scan_.lines[0].frame_positions_mm = PositionsFrom(4);
    const test::LaserWorld world{
        .width = 320, .height = 240, .plate_column_px = 180, .bead_row_px = 120};
    std::vector<Frame> frames;
    for (int f = 0; f < kFrames; ++f) {
      frames.push_back(test::DrawLaserFrame(world, 0.1 + 0.001 * f, random_));
    }
    test::WriteAvi(folder_.path() / "line0.avi", frames, 0);
  }

  static std::vector<std::optional<double>> PositionsFrom(double first_mm) {
    std::vector<std::optional<double>> positions(kStanding);
    for (int f = kStanding; f < kFrames; ++f) positions.emplace_back(first_mm + f / 5.0);
    return positions;
  }
  [[nodiscard]] std::optional<LineAhead> Take(const Scan& scan) {
    ahead_.WaitForAll();
    return ahead_.Take(folder_.path(), scan, scan.lines[0], {320, 240, "line0.avi"});
  }
  [[nodiscard]] std::vector<Frame> Read(const Scan& scan) const {
    return ReadFrames(folder_.path() / "line0.avi", scan, scan.lines[0], {320, 240, "line0.avi"})
        .value_or(std::vector<Frame>{});
  }

  test::TemporaryFolder folder_;
  Random random_{51};
  Scan scan_;
  ReadAhead ahead_;
};

bool SamePixels(const std::vector<Frame>& one, const std::vector<Frame>& other) {
  return std::equal(one.begin(), one.end(), other.begin(), other.end(),
                    [](const Frame& a, const Frame& b) { return a.bgr == b.bgr; });
}

void ExpectSame(const SweepReading& one, const SweepReading& other) {
  EXPECT_EQ(one.frame, other.frame);
  EXPECT_EQ(one.heights.height_px, other.heights.height_px);
  EXPECT_EQ(one.heights.position_mm, other.heights.position_mm);
  EXPECT_EQ(one.unplaced_frames, other.unplaced_frames);
  ASSERT_EQ(one.profile.samples.size(), other.profile.samples.size());
  for (std::size_t i = 0; i < one.profile.samples.size(); ++i) {
    EXPECT_EQ(one.profile.samples[i].position, other.profile.samples[i].position);
    EXPECT_EQ(one.profile.samples[i].area.value, other.profile.samples[i].area.value);
    EXPECT_EQ(one.profile.samples[i].area.sigma, other.profile.samples[i].area.sigma);
  }
}

TEST_F(ReadAheadTest, GivesWhatIsReadOfTheLineAnyhow) {
  ahead_.Add(folder_.path(), scan_);
  auto ahead = Take(scan_);
  ASSERT_TRUE(ahead);
  const auto frames = Read(scan_);
  EXPECT_TRUE(SamePixels(ahead->frames, frames));
  EXPECT_TRUE(frames[0].bgr.empty());  // nobody may look at a frame without a place
  vision::LaserLineWorkspace workspace;
  ExpectSame(ahead->reading, ReadSweep(frames, scan_, scan_.lines[0], {}, workspace));
  EXPECT_FALSE(Take(scan_)) << "once";
}

// The lines to come shift all positions a little, and give places to frames that had none.
TEST_F(ReadAheadTest, FollowsPositionsThatAreKnownBetterSince) {
  ahead_.Add(folder_.path(), scan_);
  Scan later = scan_;
  later.lines[0].frame_positions_mm = PositionsFrom(4.03);
  auto ahead = Take(later);
  ASSERT_TRUE(ahead);
  vision::LaserLineWorkspace workspace;
  const auto again = ReadAgain(ahead->reading, ahead->frames, later, later.lines[0]);
  ASSERT_TRUE(again);
  ExpectSame(*again, ReadSweep(Read(later), later, later.lines[0], {}, workspace));
  later.lines[0].frame_positions_mm[kStanding - 1] = 4.5;
  EXPECT_FALSE(ReadAgain(ahead->reading, Read(later), later, later.lines[0]));
}

TEST_F(ReadAheadTest, GivesNothingOfAnotherCropSizeOrNumberOfFrames) {
  Scan other = scan_;
  other.crop->x += 1;
  ahead_.Add(folder_.path(), scan_);
  EXPECT_FALSE(Take(other));
  other = scan_;
  other.lines[0].frame_positions_mm.emplace_back(29);
  ahead_.Add(folder_.path(), scan_);
  EXPECT_FALSE(Take(other));
  ahead_.Add(folder_.path(), scan_);
  ahead_.WaitForAll();
  EXPECT_FALSE(ahead_.Take(folder_.path(), scan_, scan_.lines[0], {320, 241, ""}));
}

// Several lines swept in one go share a video.
TEST_F(ReadAheadTest, GivesEachLineOfAVideoItsOwnFramesOnce) {
  constexpr std::size_t kTurn = 30;
  scan_.lines.push_back(scan_.lines[0]);
  for (std::size_t i = 0; i < kFrames; ++i) {
    (i < kTurn ? scan_.lines[1] : scan_.lines[0]).frame_positions_mm[i].reset();
  }
  ahead_.Add(folder_.path(), scan_);
  ahead_.WaitForAll();
  for (const ScanLine& line : scan_.lines) {
    const auto ahead = ahead_.Take(folder_.path(), scan_, line, {320, 240, "line0.avi"});
    ASSERT_TRUE(ahead);
    const auto frames =
        ReadFrames(folder_.path() / "line0.avi", scan_, line, {320, 240, "line0.avi"});
    ASSERT_TRUE(frames);
    EXPECT_TRUE(SamePixels(ahead->frames, *frames));
    vision::LaserLineWorkspace workspace;
    ExpectSame(ahead->reading, ReadSweep(*frames, scan_, line, {}, workspace));
    EXPECT_FALSE(ahead_.Take(folder_.path(), scan_, line, {320, 240, "line0.avi"})) << "once";
  }
}

TEST_F(ReadAheadTest, LeavesADamagedVideoToWhoSaysWhatIsWrong) {
  std::ofstream(folder_.path() / "line0.avi") << "no video";
  ahead_.Add(folder_.path(), scan_);
  EXPECT_FALSE(Take(scan_));
}

}  // namespace
}  // namespace trammel::procedure
