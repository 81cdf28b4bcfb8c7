#include "sim/camera/scan_recorder.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <nlohmann/json.hpp>
#include <string>

#include "sim/camera/jpeg.h"
#include "sim/laser/laser_test_support.h"
#include "support/temporary_folder.h"

namespace trammel::sim {
namespace {

using ::testing::HasSubstr;

struct VideoFacts {
  int frames = 0;
  std::uint32_t width = 0;
  std::uint32_t height = 0;
  std::string codec;
  double frames_per_s = 0;
};

/// What an AVI's heads state, by Microsoft's description of them, and how many JPEGs follow.
VideoFacts ProbeVideo(const std::filesystem::path& path) {
  const std::string bytes = test::ReadWhole(path);
  const auto number = [&](std::size_t at) {
    std::uint32_t value = 0;
    for (std::size_t i = 4; i-- > 0;)
      value = value << 8 | static_cast<std::uint8_t>(bytes.at(at + i));
    return value;
  };
  const std::size_t main = bytes.find("avih") + 8;
  const std::size_t format = bytes.find("strf") + 8;
  VideoFacts facts{0, number(main + 32), number(main + 36), bytes.substr(format + 16, 4),
                   1e6 / number(main)};
  for (std::size_t at = bytes.find("movi") + 4; bytes.compare(at, 4, "00dc") == 0;) {
    EXPECT_EQ(bytes.compare(at + 8, 3, "\xFF\xD8\xFF"), 0);
    ++facts.frames;
    at += 8 + number(at + 4) + number(at + 4) % 2;
    if (at >= bytes.size()) break;
  }
  EXPECT_EQ(static_cast<std::uint32_t>(facts.frames), number(main + 16));
  return facts;
}

Plan TwoLines(double length_mm) {
  Plan plan;
  plan.line_length_mm = length_mm;
  plan.acceleration_mm_s2 = 3000;
  plan.segments = {{0.25, 5}, {0.5, 150}, {0.25, 5}};
  plan.lines = {{0, 0.0, 100, 100, 100 + length_mm, 100},
                {0, 0.05, 100 + length_mm, 104, 100, 104},
                {1, 0.05, 50, 20, 50, 20 + length_mm}};
  return plan;
}

ScanOptions SmallFrames() {
  ScanOptions options;
  options.frame_width_px = 160;
  options.frame_height_px = 120;
  return options;
}

Result<void> Record(const Plan& plan, const ScanOptions& options, std::uint64_t seed,
                    const std::filesystem::path& folder) {
  Random random(seed);
  const Condition condition;
  const LaserTraits eye = DrawLaserTraits(condition, random);
  return RecordScan(StraightBead(100, 100 + plan.line_length_mm, 100, 0.5, 0.25), plan, condition,
                    eye, options, random, folder);
}

TEST(ScanRecorder, WritesTheVideosAndTheDescriptionThatTheFormatAsksFor) {
  const test::TemporaryFolder scratch;
  const auto folder = scratch.path() / "scan";
  const Result<void> done = Record(TwoLines(30), SmallFrames(), 1, folder);
  ASSERT_TRUE(done) << done.error().message;
  const auto scan = nlohmann::json::parse(test::ReadWhole(folder / "scan.json"));
  EXPECT_EQ(scan["format"], 1);
  EXPECT_EQ(scan["eye"], "laser");
  ASSERT_EQ(scan["lines"].size(), 2);
  EXPECT_EQ(scan["lines"][1]["print_direction"], "-x");
  EXPECT_EQ(scan["lines"][1]["sweep_direction"], "-x");
  for (int i = 0; i < 2; ++i) {
    const auto& line = scan["lines"][i];
    const VideoFacts video = ProbeVideo(folder / line["video"].get<std::string>());
    // 22 mm at 400 mm/min and 30 frames/s.
    EXPECT_EQ(video.frames, 99);
    EXPECT_EQ(video.codec, "MJPG");
    EXPECT_EQ(video.width, 160);
    EXPECT_EQ(video.height, 120);
    EXPECT_NEAR(video.frames_per_s, 30, 0.01);
    const auto times = line["frame_times_s"].get<std::vector<double>>();
    ASSERT_EQ(times.size(), 99);
    for (std::size_t k = 1; k < times.size(); ++k) EXPECT_GT(times[k], times[k - 1]);
  }
}

TEST(ScanRecorder, EqualSeedsWriteEqualBytes) {
  const test::TemporaryFolder scratch;
  const Plan plan = TwoLines(10);
  ASSERT_TRUE(Record(plan, SmallFrames(), 4, scratch.path() / "a"));
  ASSERT_TRUE(Record(plan, SmallFrames(), 4, scratch.path() / "b"));
  ASSERT_TRUE(Record(plan, SmallFrames(), 5, scratch.path() / "c"));
  for (const char* name : {"scan.json", "line0.avi", "line1.avi"}) {
    EXPECT_EQ(test::ReadWhole(scratch.path() / "a" / name),
              test::ReadWhole(scratch.path() / "b" / name));
  }
  EXPECT_NE(test::ReadWhole(scratch.path() / "a/line0.avi"),
            test::ReadWhole(scratch.path() / "c/line0.avi"));
}

TEST(ScanRecorder, LinesAlongYAreScannedWithTheEyeTurned) {
  const test::TemporaryFolder scratch;
  ScanOptions options = SmallFrames();
  options.pattern = 1;
  ASSERT_TRUE(Record(TwoLines(10), options, 4, scratch.path() / "y"));
  const auto scan = nlohmann::json::parse(test::ReadWhole(scratch.path() / "y/scan.json"));
  ASSERT_EQ(scan["lines"].size(), 1);
  EXPECT_EQ(scan["lines"][0]["print_direction"], "+y");
}

TEST(ScanRecorder, RefusesWhatItCannotDo) {
  const test::TemporaryFolder scratch;
  Result<void> done = Record(TwoLines(30), SmallFrames(), 1, scratch.path());
  ASSERT_FALSE(done);
  EXPECT_THAT(done.error().message, HasSubstr("exists already"));
  done = Record(TwoLines(8.1), SmallFrames(), 1, scratch.path() / "short");
  ASSERT_FALSE(done);
  EXPECT_THAT(done.error().message, HasSubstr("8.1 mm are too short"));
  ScanOptions options = SmallFrames();
  options.pattern = 9;
  done = Record(TwoLines(30), options, 1, scratch.path() / "none");
  ASSERT_FALSE(done);
  EXPECT_THAT(done.error().message, HasSubstr("no line of pattern 9"));
  EXPECT_FALSE(std::filesystem::exists(scratch.path() / "none"));
  done = Record(TwoLines(30), SmallFrames(), 1, "/proc/trammel/scan");
  ASSERT_FALSE(done);
  EXPECT_THAT(done.error().message, HasSubstr("cannot be created"));
}

TEST(ScanRecorder, TruthNamesTheWorld) {
  const test::TemporaryFolder scratch;
  ASSERT_TRUE(WriteTruth(scratch.path(), {0.0361}, 1007, "matte-black-dark"));
  const auto truth = nlohmann::json::parse(test::ReadWhole(scratch.path() / "truth.json"));
  EXPECT_EQ(truth, nlohmann::json::parse(R"({"format": 1, "pressure_advance_s": 0.0361,
                                             "seed": 1007, "condition": "matte-black-dark"})"));
}

TEST(Conditions, NamesReadBackAndOthersAreRefused) {
  for (const Condition& condition : AllConditions()) {
    const Result<Condition> again = ParseCondition(ToString(condition));
    ASSERT_TRUE(again);
    EXPECT_EQ(ToString(*again), ToString(condition));
  }
  const Result<Condition> wrong = ParseCondition("matte-pink-dark");
  ASSERT_FALSE(wrong);
  EXPECT_THAT(wrong.error().message, HasSubstr("matte-black-dark"));
}

}  // namespace
}  // namespace trammel::sim
