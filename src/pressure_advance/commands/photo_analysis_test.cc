#include "pressure_advance/commands/photo_analysis.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "pressure_advance/commands/photo_batch.h"

namespace trammel::app {
namespace {

using pressure_advance::PhotoMeasurement;
using ::testing::AllOf;
using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::IsEmpty;
using ::testing::Not;

PhotoMeasurement ChangesAt(double begin, double end) {
  PhotoMeasurement seen;
  seen.segments = {.fast_begin = begin, .fast_end = end};
  return seen;
}

TEST(MotionSeen, TheNoticeNamesThePlacesThatAreUsed) {
  PhotoPlan plan;
  plan.segments = {{0.25, 20}, {0.5, 100}, {0.25, 20}};
  std::vector<std::string> notices;
  auto motion = MotionSeen(plan, ChangesAt(0.35, 0.85), notices);
  EXPECT_DOUBLE_EQ(motion.segments[0].fraction, 0.35);
  EXPECT_DOUBLE_EQ(motion.segments[2].fraction, 1 - 0.85);
  EXPECT_THAT(notices, ElementsAre(HasSubstr("0.35 and 0.85 are used")));

  // Of a known length, what the photo shows later than the plan is a ramp.
  plan.length_mm = 80;
  notices.clear();
  motion = MotionSeen(plan, ChangesAt(0.35, 0.7), notices);
  EXPECT_DOUBLE_EQ(motion.segments[0].fraction, 0.25);
  EXPECT_DOUBLE_EQ(motion.segments[1].fraction, 0.7 - 0.25);
  EXPECT_THAT(notices, ElementsAre(AllOf(HasSubstr("0.35 and 0.70 of their length in the photo"),
                                         HasSubstr("0.25 and 0.70 are used"))));
  notices.clear();
  motion = MotionSeen(plan, ChangesAt(0.28, 0.73), notices);
  EXPECT_THAT(notices, IsEmpty());
}

TEST(PrintAnswer, UnusedLinesWithoutAReasonOfTheirOwnAreNotListed) {
  pressure_advance::Analysis analysis;
  analysis.lines.resize(2);
  analysis.lines[1].reason = "torn";
  analysis.pressure_advance = Measured::Refused("too fast");
  ::testing::internal::CaptureStdout();
  PrintAnswer(analysis);
  const std::string text = ::testing::internal::GetCapturedStdout();
  EXPECT_THAT(text, AllOf(HasSubstr("0 of 2 used\n  at 0.0000 s: torn\n"), HasSubstr("too fast")));
  EXPECT_THAT(text, Not(HasSubstr("s: \n")));
}

TEST(PhotoBatch, SeveralPatternsOfLinesAreNamedByTheirPlatesOrPlaces) {
  files::SlicerPrint print;
  print.patterns.resize(2);
  print.patterns[0].pressure_advance_s = {0, 0.05, 0.1};
  print.patterns[1].pressure_advance_s = {0, 0.02, 0.04, 0.06};
  print.patterns[1].x_mm = 150;
  const auto message_of = [&] {
    const auto run = RunPhotoBatch({"photo.jpg"}, "print.gcode.3mf", print, false);
    return run ? std::string() : run.error().message;
  };
  EXPECT_THAT(message_of(),
              AllOf(HasSubstr("print.gcode.3mf"), HasSubstr("x 0, y 0 mm: 3 lines from 0 to 0.1 s"),
                    HasSubstr("x 150, y 0 mm: 4 lines from 0 to 0.06 s"), HasSubstr("--pa")));
  print.patterns[0].plate = "plate_1";
  print.patterns[1].plate = "plate_3";
  EXPECT_THAT(message_of(), AllOf(HasSubstr("plate_1: 3 lines from 0 to 0.1 s"),
                                  HasSubstr("plate_3: 4 lines"), HasSubstr("--plate plate_1")));
}

}  // namespace
}  // namespace trammel::app
