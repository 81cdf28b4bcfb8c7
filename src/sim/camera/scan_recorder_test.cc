#include "sim/camera/scan_recorder.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <nlohmann/json.hpp>

#include "sim/laser/laser_test_support.h"
#include "support/temporary_folder.h"

namespace trammel::sim {
namespace {

using ::testing::HasSubstr;

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
  const LaserTraits optics = DrawLaserTraits(condition, random);
  return RecordScan(StraightBead(100, 100 + plan.line_length_mm, 100, 0.5, 0.25), plan, condition,
                    optics, options, random, folder);
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

}  // namespace
}  // namespace trammel::sim
