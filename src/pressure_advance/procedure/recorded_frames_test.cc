#include "pressure_advance/procedure/recorded_frames.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <nlohmann/json.hpp>
#include <stop_token>
#include <string>
#include <vector>

#include "pressure_advance/files/recording.h"
#include "support/sweep_world.h"

namespace trammel::procedure {
namespace {

using pressure_advance::Scan;
using ::testing::AllOf;

using ::testing::HasSubstr;
using ::testing::IsEmpty;
using ::testing::SizeIs;
using ::testing::UnorderedElementsAre;

constexpr int kFrames = 70;

// Lines under a laser, in frames of 320 x 240 px.
class RecordingCutterTest : public ::testing::Test {
 protected:
  RecordingCutterTest() {
    scan_.scan_speed_mm_s = 10;
    scan_.px_per_mm = 44;
    scan_.line_start_mm = 4;
    scan_.motion = {.segments = {{0.25, 5}, {0.5, 150}, {0.25, 5}},
                    .length_mm = 30,
                    .acceleration_mm_s2 = 3000};
    scan_.crop = PixelRect{145, 90, 45, 60};
  }

  /// The scan of one line, drawn with a bead of that area (0: none) and a laser or without.
  Scan Draw(const std::string& video, double area_mm2, bool laser = true,
            double plate_column_px = 180) {
    test::LaserWorld world{
        .width = 320, .height = 240, .plate_column_px = plate_column_px, .bead_row_px = 120};
    if (!laser) world.plate_amplitude = world.bead_amplitude = 0;
    std::vector<Frame> frames;
    Scan scan = scan_;
    scan.lines.resize(1);
    scan.lines[0].video = video;
    for (int f = 0; f < kFrames; ++f) {
      frames.push_back(test::DrawLaserFrame(world, area_mm2, random_));
      const bool standing = f < 5;
      scan.lines[0].frame_positions_mm.emplace_back();
      if (!standing) scan.lines[0].frame_positions_mm.back() = 4 + f / 5.0;
    }
    test::WriteAvi(folder_.path() / video, frames, 0);
    return scan;
  }
  /// The recording of these lines.
  void Write(const std::vector<Scan>& lines) {
    Scan all = lines.front();
    all.lines.clear();
    for (const Scan& line : lines) all.lines.push_back(line.lines.front());
    test::WriteWhole(folder_.path() / "scan.json", files::FormatScan(all, {}));
  }
  [[nodiscard]] std::uintmax_t SizeOfFile(const std::string& video) const {
    return std::filesystem::file_size(folder_.path() / video);
  }
  [[nodiscard]] std::vector<Frame> Read(const Scan& scan) const {
    const auto size = SizeOf(folder_.path(), scan);
    auto frames = ReadFrames(folder_.path() / scan.lines[0].video, scan, scan.lines[0], *size);
    EXPECT_TRUE(frames) << frames.error().message;
    return frames.value_or(std::vector<Frame>{});
  }

  test::TemporaryFolder folder_;
  Random random_{41};
  Scan scan_;
};

TEST_F(RecordingCutterTest, CutsEachLineAndWhatIsReadStaysTheSame) {
  const std::vector<Scan> lines = {Draw("line0.avi", 0.1), Draw("line1.avi", 0.12)};
  std::vector<std::vector<Frame>> before;
  std::vector<std::uintmax_t> bytes;
  for (const Scan& line : lines) {
    before.push_back(Read(line));
    bytes.push_back(SizeOfFile(line.lines[0].video));
  }
  Write(lines);
  EXPECT_THAT(CutRecording(folder_.path(), {}), IsEmpty());
  for (std::size_t i = 0; i < lines.size(); ++i) {
    EXPECT_LT(SizeOfFile(lines[i].lines[0].video), bytes[i] / 4);
    const std::vector<Frame> after = Read(lines[i]);
    ASSERT_THAT(after, SizeIs(kFrames));
    for (int f = 0; f < kFrames; ++f) {
      EXPECT_EQ(after[static_cast<std::size_t>(f)].bgr, before[i][static_cast<std::size_t>(f)].bgr);
    }
  }
}

TEST_F(RecordingCutterTest, ALineThatDoesNotReadWellInTheCropStaysWhole) {
  const Scan dark = Draw("dark.avi", 0.1, false);
  const Scan high = Draw("high.avi", 0.1, true, 153);  // the bead's top lies left of the crop
  const Scan gone = Draw("gone.avi", 0.1);
  std::filesystem::remove(folder_.path() / "gone.avi");
  const auto dark_bytes = SizeOfFile("dark.avi");
  const auto high_bytes = SizeOfFile("high.avi");
  Write({dark, high, gone});
  EXPECT_THAT(CutRecording(folder_.path(), {}),
              UnorderedElementsAre(AllOf(HasSubstr("dark.avi keeps"), HasSubstr("no laser line")),
                                   AllOf(HasSubstr("high.avi keeps"), HasSubstr("out of the crop")),
                                   AllOf(HasSubstr("gone.avi keeps"), HasSubstr("no such file"))));
  EXPECT_EQ(SizeOfFile("dark.avi"), dark_bytes);
  EXPECT_EQ(SizeOfFile("high.avi"), high_bytes);
}

TEST_F(RecordingCutterTest, AStopLeavesEveryLineReadable) {
  const std::vector<Scan> lines = {Draw("line0.avi", 0.1), Draw("line1.avi", 0.1)};
  Write(lines);
  std::stop_source stop;
  stop.request_stop();
  EXPECT_THAT(CutRecording(folder_.path(), stop.get_token()), IsEmpty());
  for (const Scan& line : lines) EXPECT_THAT(Read(line), SizeIs(kFrames));
}

}  // namespace
}  // namespace trammel::procedure
