#include "pressure_advance/procedure/scan.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <chrono>
#include <fstream>
#include <nlohmann/json.hpp>
#include <string>
#include <thread>
#include <utility>

#include "base/random.h"
#include "machine/net/host_clock.h"
#include "pressure_advance/files/recording.h"
#include "pressure_advance/procedure/scan_recording.h"
#include "session/fake_printer.h"
#include "support/sweep_world.h"
#include "support/temporary_folder.h"
#include "support/test_pictures.h"

namespace trammel::procedure {
namespace {

using ::testing::AllOf;
using ::testing::HasSubstr;
using ::testing::IsEmpty;

Check CheckDrawn(const test::LaserWorld& world) {
  Random random(1);
  machine::CapturedFrame frame;
  const std::string jpeg = test::JpegOf(test::DrawLaserFrame(world, 0, random), 90);
  frame.image.assign(jpeg.begin(), jpeg.end());
  settings::ScanSettings settings;
  settings.px_per_mm = 44;
  return CheckLaserLine(frame, settings);
}

test::LaserWorld WholePicture() {
  test::LaserWorld world;
  world.width = 320;
  world.height = 240;
  world.plate_column_px = 170;
  world.plate_amplitude = 180;
  return world;
}

TEST(LaserCheck, ASharpLinePassesWithItsWidth) {
  const Check check = CheckDrawn(WholePicture());
  EXPECT_TRUE(check.passed);
  EXPECT_THAT(check.detail, AllOf(HasSubstr("px (0.1"), HasSubstr("grey levels over the plate")));
}

TEST(LaserCheck, WhatIsWrongWithTheLineIsAdviceWithItsRemedy) {
  test::LaserWorld blurred = WholePicture();
  blurred.stripe_sigma_px = 8;
  blurred.plate_amplitude = 110;
  const Check wide = CheckDrawn(blurred);
  EXPECT_FALSE(wide.passed);
  EXPECT_TRUE(wide.advice);
  EXPECT_THAT(wide.detail, AllOf(HasSubstr("out of focus"), HasSubstr("focus_height")));
  test::LaserWorld dim = WholePicture();
  dim.plate_amplitude = 15;
  dim.noise = 0.5;
  EXPECT_THAT(CheckDrawn(dim).detail, HasSubstr("raise the camera's exposure"));
  test::LaserWorld burnt = WholePicture();
  burnt.plate_amplitude = 4000;
  EXPECT_THAT(CheckDrawn(burnt).detail, HasSubstr("overexposed"));
}

class DarkCamera final : public machine::FrameSource {
 public:
  Result<std::optional<machine::CapturedFrame>> Next(double, std::stop_token) override {
    std::this_thread::sleep_for(std::chrono::milliseconds(2));
    machine::CapturedFrame frame;
    const std::string jpeg = test::JpegOf(test::TestPicture(48, 32, 3));
    frame.image.assign(jpeg.begin(), jpeg.end());
    frame.width_px = 48, frame.height_px = 32;
    frame.arrival_s = machine::HostNow();
    return frame;
  }
  [[nodiscard]] std::string Describe() const override { return "dark"; }
  [[nodiscard]] bool live() const override { return true; }
};

TEST(LaserCheck, LightsNoLaserInAnothersPrint) {
  testing::FakePrinter printer;
  printer.state.print_state = "printing";
  printer.state.print_file = "vase.gcode";
  DarkCamera camera;
  FrameRecorder recorder(camera, 5);
  const auto seen = CheckLaser({printer, {}, {}}, recorder, {});
  ASSERT_FALSE(seen);
  EXPECT_THAT(seen.error().message, HasSubstr("vase.gcode is printing"));
  EXPECT_THAT(printer.scripts, IsEmpty());
}

TEST(LaserCheck, APictureThatCannotBeReadIsNoPass) { EXPECT_FALSE(CheckLaserLine({}, {}).passed); }

using machine::CameraClock;
using machine::CameraTime;
using machine::CapturedFrame;
using ::testing::Not;

// Lines of a pattern swept under a camera whose pictures show where it is.
class ScanRecordingTest : public ::testing::Test {
 protected:
  ScanRecordingTest() {
    world_.still_s = 0.5;
    request_.folder = folder_.path();
    request_.settings.frames_per_s = 1 / world_.period_s;
    request_.plan.segments = {{0.25, 5}, {0.5, 150}, {0.25, 5}};
    request_.plan.line_length_mm = 30;
    request_.plan.acceleration_mm_s2 = 3000;
    for (int line = 0; line < 4; ++line) {
      request_.plan.lines.emplace_back().pressure_advance_s = 0.01 * line;
    }
    Random random(3);
    session_ = test::RecordSession(world_, 4, random);
  }

  [[nodiscard]] RecordedSweep Sweep(std::size_t number) const {
    const test::WorldSweep& seen = session_.at(number);
    RecordedSweep sweep;
    const SweptStretch whole{world_.start_mm, world_.end_mm, 0, 1};
    sweep.lines = {{0.01 * static_cast<double>(number), AxisDirection::kPlusX, whole}};
    sweep.video = "line" + std::to_string(number) + ".avi";
    sweep.motion = pressure_advance::TrapezoidSweep(seen.start_s, world_.start_mm, world_.end_mm,
                                                    world_.speed_mm_s, world_.acceleration_mm_s2);
    sweep.clock_sigma_s = 0.001;
    for (const test::SweepFrame& frame : seen.frames) {
      CapturedFrame taken;
      // A wave of 1.6 mm: a frame's way of 0.22 mm turns it by 50 degrees.
      constexpr double kPhase_mm = 0.02;
      const auto phase = static_cast<int>(std::lround(frame.true_position_mm / kPhase_mm));
      const std::string jpeg = test::JpegOf(test::TestPicture(48, 32, phase));
      taken.image.assign(jpeg.begin(), jpeg.end());
      taken.width_px = 48;
      taken.height_px = 32;
      taken.arrival_s = frame.arrival_s;
      taken.captured = CameraTime{frame.stamp_s, CameraClock::kOurs};
      sweep.frames.push_back(std::move(taken));
    }
    return sweep;
  }
  [[nodiscard]] nlohmann::json File(const char* name) const {
    std::ifstream file(folder_.path() / name);
    return nlohmann::json::parse(file, nullptr, false);
  }

  test::TemporaryFolder folder_;
  test::SweepWorld world_;
  std::vector<test::WorldSweep> session_;
  ScanRequest request_;
};

TEST_F(ScanRecordingTest, ASweepThatABusyComputerBrokeIsNamedAndCanBeSweptAgain) {
  ScanRecording recording(request_, request_.plan.lines.size());
  ASSERT_TRUE(recording.Begin());
  for (const std::size_t number : {0, 1}) {
    ASSERT_TRUE(recording.Add(Sweep(number)));
    EXPECT_FALSE(recording.trouble()) << *recording.trouble();
  }
  // A third of the frames never came, and the others late: too few are left of the standing head.
  RecordedSweep broken = Sweep(2);
  std::vector<CapturedFrame> kept;
  for (std::size_t i = 0; i < broken.frames.size(); ++i) {
    if (i < 16 || i % 3 != 0) {
      broken.frames[i].arrival_s += i < 16 ? 0 : 0.186;
      kept.push_back(broken.frames[i]);
    }
  }
  kept.erase(kept.begin(), kept.begin() + 14);
  broken.frames = std::move(kept);
  ASSERT_TRUE(recording.Add(std::move(broken)));
  ASSERT_TRUE(recording.trouble());
  EXPECT_THAT(*recording.trouble(), AllOf(HasSubstr("ms late and "), HasSubstr("too busy")));
  EXPECT_EQ(recording.placed(), 2U);
  EXPECT_EQ(File("scan.json")["lines"].size(), 2U);
  EXPECT_THAT(File("sweeps.json")["not_placed"][0]["why"].get<std::string>(),
              HasSubstr("too busy"));
  EXPECT_GT(File("sweeps.json")["sweeps"][2]["late_s"].get<double>(), 0.15);
  EXPECT_FALSE(File("scan.json")["lines"][0].contains("lost_frames"));

  ASSERT_TRUE(recording.SetLastAside());
  RecordedSweep again = Sweep(2);
  again.video = "line2-2.avi";
  ASSERT_TRUE(recording.Add(std::move(again)));
  EXPECT_FALSE(recording.trouble()) << *recording.trouble();
  ASSERT_TRUE(recording.Add(Sweep(3)));
  EXPECT_TRUE(recording.Finish());
  EXPECT_TRUE(recording.LeftOut().empty());
  const auto scan = files::ReadScan(folder_.path());
  ASSERT_TRUE(scan) << scan.error().message;
  ASSERT_EQ(scan->lines.size(), 4U);
  EXPECT_EQ(scan->lines[2].video, "line2-2.avi");
  const auto sweeps = File("sweeps.json");
  ASSERT_EQ(sweeps["swept_again"].size(), 1U);
  EXPECT_EQ(sweeps["swept_again"][0]["video"], "line2.avi");
  EXPECT_TRUE(sweeps["not_placed"].empty());
}

TEST_F(ScanRecordingTest, AClockThatIsHardlyKnownIsNamedAndPlacesNothing) {
  ScanRecording recording(request_, request_.plan.lines.size());
  RecordedSweep sweep = Sweep(0);
  sweep.clock_sigma_s = 0.05;
  ASSERT_TRUE(recording.Add(std::move(sweep)));
  ASSERT_TRUE(recording.trouble());
  EXPECT_THAT(*recording.trouble(),
              AllOf(HasSubstr("printer's clock was told to 50 ms"), HasSubstr("too busy")));
  EXPECT_EQ(recording.placed(), 0U);
}

TEST_F(ScanRecordingTest, RefusesWithTheReasonAndNeverBlamesTheRecording) {
  ScanRecording recording(request_, request_.plan.lines.size());
  for (const std::size_t number : {0, 1, 2}) {
    RecordedSweep sweep = Sweep(number);
    for (auto& move : sweep.motion) move.start_s += 0.3;
    ASSERT_TRUE(recording.Add(std::move(sweep)));
    ASSERT_TRUE(recording.trouble());
  }
  const auto finished = recording.Finish();
  ASSERT_FALSE(finished);
  EXPECT_EQ(finished.error().kind, ErrorKind::kMeasurement);
  EXPECT_THAT(finished.error().message,
              AllOf(HasSubstr("earlier than the clocks allow"), HasSubstr(folder_.path().string()),
                    Not(HasSubstr("right recording"))));
  EXPECT_FALSE(std::filesystem::exists(folder_.path() / "scan.json"));
  EXPECT_THAT(files::ReadScan(folder_.path()).error().message,
              HasSubstr("earlier than the clocks allow"));
}

// Two lines in one go, the second one against its print.
TEST_F(ScanRecordingTest, LinesThatAreSweptInOneGoShareAVideoAndNoFrame) {
  constexpr double kTurn_mm = 4;
  const double middle_mm = (world_.start_mm + world_.end_mm) / 2;
  RecordedSweep both = Sweep(0);
  both.lines = {
      {0.0, AxisDirection::kPlusX, {world_.start_mm, middle_mm - kTurn_mm / 2, 0, 1}},
      {0.01, AxisDirection::kPlusX, {middle_mm + kTurn_mm / 2, world_.end_mm, world_.end_mm, -1}}};
  ScanRecording recording(request_, 2);
  ASSERT_TRUE(recording.Begin());
  ASSERT_TRUE(recording.Add(both));
  ASSERT_TRUE(recording.Add(Sweep(1)));
  EXPECT_EQ(recording.placed(), 3U);
  const nlohmann::json lines = File("scan.json")["lines"];
  ASSERT_EQ(lines.size(), 3U);
  EXPECT_EQ(lines[0]["video"], lines[1]["video"]);
  const auto& first = lines[0]["frame_positions_mm"];
  const auto& second = lines[1]["frame_positions_mm"];
  const auto& whole = lines[2]["frame_positions_mm"];
  std::size_t of_first = 0, of_second = 0;
  for (std::size_t i = 0; i < first.size(); ++i) {
    of_first += !first[i].is_null();
    of_second += !second[i].is_null();
    EXPECT_TRUE(first[i].is_null() || second[i].is_null()) << i;
    if (!second[i].is_null()) {
      EXPECT_LT(second[i], world_.end_mm - middle_mm) << "the way back";
    }
  }
  EXPECT_GT(of_first, 10U);
  EXPECT_GT(of_second, 10U);
  EXPECT_LT(of_first + of_second, whole.size());
  const nlohmann::json sweeps = File("sweeps.json")["sweeps"];
  EXPECT_EQ(sweeps[0]["lines"].size(), 2U);
  EXPECT_TRUE(sweeps[0]["lines"][1]["backwards"]);
  EXPECT_FALSE(sweeps[1].contains("lines"));
}

TEST(ScanRecording, TakesACameraWhoseNameIsNotUtf8) {
  const test::TemporaryFolder folder;
  ScanRequest request;
  request.folder = folder.path();
  request.camera = "MJPEG stream http://camera/?at=\xFF";
  ScanRecording recording(request, request.plan.lines.size());
  ASSERT_TRUE(recording.Begin());
  const auto sweeps = nlohmann::json::parse(test::ReadWhole(folder.path() / "sweeps.json"));
  EXPECT_EQ(sweeps["camera"], "MJPEG stream http://camera/?at=\xEF\xBF\xBD");
}

}  // namespace
}  // namespace trammel::procedure
