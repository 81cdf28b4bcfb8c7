#include "pressure_advance/commands/laser_recording.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <filesystem>
#include <fstream>
#include <nlohmann/json.hpp>
#include <string>

#include "machine/video/video_cutter.h"
#include "support/sweep_world.h"

namespace trammel::app {
namespace {

using nlohmann::json;
using test::LaserWorld;
using ::testing::AllOf;
using ::testing::HasSubstr;

constexpr int kFrames = 60;

/// Nominal 0.10 mm²; too little PA starves the middle third, too much overfeeds it.
double AreaAt(int frame, double pressure_advance_s) {
  const double bump = std::exp(-0.5 * std::pow((frame - 30) / 4.0, 2));
  return 0.10 * (1 + 20 * (pressure_advance_s - 0.03) * bump);
}

class MeasureRecordingTest : public testing::Test {
 protected:
  void SetUp() override {
    Random random(31);
    scan_ = {{"format", 1},
             {"eye", "laser"},
             {"scan_speed_mm_s", 10.0},
             {"px_per_mm", 44.0},
             {"lines", json::array()}};
    for (int i = 0; i < 6; ++i) {
      std::vector<Frame> frames;
      for (int f = 0; f < kFrames; ++f) {
        frames.push_back(test::DrawLaserFrame(world_, AreaAt(f, 0.01 * i), random));
      }
      const std::string video = "line" + std::to_string(i) + ".avi";
      test::WriteAvi(folder_.path() / video, frames, 0);
      scan_["lines"].push_back({{"pressure_advance_s", 0.01 * i}, {"video", video}});
    }
  }
  /// The recording with whatever scan_ says by now.
  Result<LaserMeasurement> Measure() {
    std::ofstream(folder_.path() / "scan.json") << scan_.dump();
    return MeasureRecording(folder_.path());
  }
  [[nodiscard]] std::string Fault(ErrorKind kind) {
    const auto result = Measure();
    if (result) {
      return "no error";
    }
    EXPECT_EQ(result.error().kind, kind);
    return result.error().message;
  }

  LaserWorld world_{.width = 110, .height = 96, .plate_column_px = 70, .bead_row_px = 45};
  test::TemporaryFolder folder_;
  json scan_;
};

TEST_F(MeasureRecordingTest, ALinkOutOfTheRecordingIsRefused) {
  const test::TemporaryFolder elsewhere;
  const auto video = folder_.path() / "line3.avi";
  std::filesystem::rename(video, elsewhere.path() / "other.avi");
  std::filesystem::create_symlink(elsewhere.path() / "other.avi", video);
  EXPECT_THAT(Fault(ErrorKind::kMeasurement),
              AllOf(HasSubstr("line3.avi"), HasSubstr("link out of the recording's folder")));
  // Within the folder a link is as good as the file.
  std::filesystem::remove(video);
  std::filesystem::rename(elsewhere.path() / "other.avi", folder_.path() / "renamed.avi");
  std::filesystem::create_symlink("renamed.avi", video);
  EXPECT_TRUE(Measure());
}

TEST_F(MeasureRecordingTest, ReadsAreasAndDeviationsAndFindsTheCropItself) {
  const auto result = Measure();
  ASSERT_TRUE(result.has_value()) << result.error().message;
  ASSERT_EQ(result->profiles.size(), 6U);
  ASSERT_TRUE(result->scan.crop.has_value());
  EXPECT_THAT(result->notices, testing::Contains(HasSubstr("crop_px was not given")));
  for (int i = 0; i < 6; ++i) {
    const auto& profile = result->profiles[static_cast<std::size_t>(i)];
    ASSERT_EQ(profile.unusable, "");
    ASSERT_EQ(profile.samples.size(), static_cast<std::size_t>(kFrames));
    EXPECT_NEAR(profile.samples[3].position, 4 + 1, 1e-9);
    const double edge = profile.samples[5].area.value;
    const double middle = profile.samples[30].area.value;
    EXPECT_NEAR(middle / edge, AreaAt(30, 0.01 * i) / 0.10, 0.15) << i;
  }
  EXPECT_EQ(result->deviation.best_s, 0.03);
  ASSERT_TRUE(result->deviation.cubic_minimum_s.has_value());
  EXPECT_NEAR(*result->deviation.cubic_minimum_s, 0.03, 0.004);
  EXPECT_EQ(result->view.heights.size(), 6U);
  EXPECT_EQ(result->view.paper_heights[2].frames, static_cast<std::size_t>(kFrames));
}

TEST_F(MeasureRecordingTest, NamesWhatIsWrongWithAVideo) {
  const auto video = folder_.path() / "line2.avi";
  std::filesystem::remove(video);
  EXPECT_THAT(Fault(ErrorKind::kMeasurement), AllOf(HasSubstr("line2.avi"), HasSubstr("no such")));
  Random random(32);
  LaserWorld small = world_;
  small.width = 90;
  test::WriteAvi(video, {test::DrawLaserFrame(small, 0.1, random)}, 1);
  EXPECT_THAT(Fault(ErrorKind::kMeasurement),
              AllOf(HasSubstr("line2.avi"), HasSubstr("90x96"), HasSubstr("110x96")));
}

TEST_F(MeasureRecordingTest, RefusesACropBeyondTheFrameAndTimesForOtherFrames) {
  scan_["crop_px"] = {{"x", 80}, {"y", 15}, {"width", 45}, {"height", 60}};
  EXPECT_THAT(Fault(ErrorKind::kInput), AllOf(HasSubstr("crop_px"), HasSubstr("110x96")));
  scan_.erase("crop_px");
  scan_["lines"][0]["frame_times_s"] = {0.0, 0.1, 0.2};
  EXPECT_THAT(Fault(ErrorKind::kMeasurement),
              AllOf(HasSubstr("line0.avi"), HasSubstr("60 frames"), HasSubstr("3 times")));
}

TEST_F(MeasureRecordingTest, JunkFramesWithoutAPositionChangeNeitherProfilesNorScoresNorTheCrop) {
  std::vector<std::vector<Frame>> sweeps;
  Random random(33);
  for (int line = 0; line < 6; ++line) {
    sweeps.emplace_back();
    for (int f = 0; f < kFrames; ++f) {
      sweeps.back().push_back(test::DrawLaserFrame(world_, AreaAt(f, 0.01 * line), random));
    }
    test::WriteAvi(folder_.path() / ("line" + std::to_string(line) + ".avi"), sweeps.back(), 0);
  }
  const auto clean = Measure();
  ASSERT_TRUE(clean.has_value()) << clean.error().message;
  for (int line = 0; line < 6; ++line) {
    std::vector<Frame> frames;
    json positions = json::array();
    for (int f = 0; f < kFrames; ++f) {
      for (int junk = f % 7 == 0 ? 4 : 0; junk > 0; --junk) {
        LaserWorld elsewhere = world_;
        elsewhere.plate_column_px = 30 + 10 * junk;
        frames.push_back(test::DrawLaserFrame(elsewhere, 0.3, random));
        positions.push_back(nullptr);
      }
      frames.push_back(sweeps[static_cast<std::size_t>(line)][static_cast<std::size_t>(f)]);
      positions.push_back(4 + f / 30.0 * 10);
    }
    test::WriteAvi(folder_.path() / ("line" + std::to_string(line) + ".avi"), frames, 0);
    scan_["lines"][static_cast<std::size_t>(line)]["frame_positions_mm"] = positions;
  }
  const auto mixed = Measure();
  ASSERT_TRUE(mixed.has_value()) << mixed.error().message;
  EXPECT_EQ(mixed->scan.crop->x, clean->scan.crop->x);
  EXPECT_EQ(mixed->scan.crop->width, clean->scan.crop->width);
  EXPECT_EQ(mixed->deviation.score_px, clean->deviation.score_px);
  EXPECT_EQ(mixed->deviation.cubic_minimum_s, clean->deviation.cubic_minimum_s);
  for (std::size_t line = 0; line < 6; ++line) {
    ASSERT_EQ(mixed->profiles[line].samples.size(), clean->profiles[line].samples.size());
    for (std::size_t i = 0; i < clean->profiles[line].samples.size(); ++i) {
      EXPECT_EQ(mixed->profiles[line].samples[i].area.value,
                clean->profiles[line].samples[i].area.value);
    }
  }
  EXPECT_THAT(mixed->notices, testing::Contains(HasSubstr("32 frames of the sweep left out")));
  scan_["lines"][2]["frame_positions_mm"].push_back(nullptr);
  EXPECT_THAT(Fault(ErrorKind::kMeasurement),
              AllOf(HasSubstr("line2.avi"), HasSubstr("96 frames"), HasSubstr("97 entries")));
}

TEST_F(MeasureRecordingTest, FramesCutToTheCropReadToTheBitAsWholeOnes) {
  Random random(34);
  world_.width = 320;
  world_.height = 240;
  world_.plate_column_px = 180;
  world_.bead_row_px = 120;
  for (int line = 0; line < 6; ++line) {
    std::vector<Frame> frames;
    for (int f = 0; f < kFrames; ++f) {
      frames.push_back(test::DrawLaserFrame(world_, AreaAt(f, 0.01 * line), random));
    }
    test::WriteAvi(folder_.path() / ("line" + std::to_string(line) + ".avi"), frames, 0);
  }
  const auto whole = Measure();
  ASSERT_TRUE(whole) << whole.error().message;
  const PixelRect crop = *whole->scan.crop;
  const auto keys = [](const PixelRect& rect) {
    return json{{"x", rect.x}, {"y", rect.y}, {"width", rect.width}, {"height", rect.height}};
  };
  scan_["found_crop_px"] = keys(crop);
  for (int line = 0; line < 6; ++line) {
    if (line == 4) continue;  // a recording may have both
    const auto video = folder_.path() / ("line" + std::to_string(line) + ".avi");
    const auto bytes = std::filesystem::file_size(video);
    auto cut = machine::CutVideo::Write(video, {crop, 25, 30}, {});
    ASSERT_TRUE(cut && cut->TakePlace());
    EXPECT_LT(std::filesystem::file_size(video), bytes / 2);
  }
  const auto cut = Measure();
  ASSERT_TRUE(cut) << cut.error().message;
  EXPECT_EQ(cut->notices, whole->notices);
  EXPECT_EQ(cut->deviation.score_px, whole->deviation.score_px);
  for (std::size_t line = 0; line < 6; ++line) {
    ASSERT_EQ(cut->profiles[line].samples.size(), whole->profiles[line].samples.size());
    for (std::size_t i = 0; i < whole->profiles[line].samples.size(); ++i) {
      EXPECT_EQ(cut->profiles[line].samples[i].area.value,
                whole->profiles[line].samples[i].area.value);
    }
  }
  // The whole frames give another crop, of which the cut ones hold too little.
  scan_.erase("found_crop_px");
  EXPECT_THAT(Fault(ErrorKind::kMeasurement), HasSubstr("'line0.avi' was cut"));
  scan_["crop_px"] = keys({0, 0, 45, 60});
  EXPECT_THAT(Fault(ErrorKind::kMeasurement),
              AllOf(HasSubstr("crop_px is 45x60 at (0, 0)"), HasSubstr("line0.avi' was cut"),
                    HasSubstr("--keep-full")));
}

TEST_F(MeasureRecordingTest, ALineWithoutLaserIsUnusableButNoError) {
  scan_["crop_px"] = {{"x", 35}, {"y", 15}, {"width", 45}, {"height", 60}};
  std::vector<Frame> black;
  for (int f = 0; f < kFrames; ++f) {
    black.emplace_back(110, 96);
    black.back().bgr[static_cast<std::size_t>(f)] = 200;  // not one picture all along
  }
  test::WriteAvi(folder_.path() / "line4.avi", black, 0);
  const auto result = Measure();
  ASSERT_TRUE(result.has_value()) << result.error().message;
  EXPECT_THAT(result->profiles[4].unusable, testing::Not(testing::IsEmpty()));
  EXPECT_FALSE(result->deviation.score_px[4].has_value());
  EXPECT_EQ(result->profiles[3].unusable, "");
}

}  // namespace
}  // namespace trammel::app
