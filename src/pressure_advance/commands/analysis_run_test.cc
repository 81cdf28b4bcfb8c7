#include "pressure_advance/commands/analysis_run.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace trammel::app {
namespace {

using ::testing::AllOf;
using ::testing::EndsWith;
using ::testing::HasSubstr;
using ::testing::StartsWith;

constexpr std::size_t kLines = 10;

// A scan whose first lines lost half of their frames, and so were not used.
struct Disturbed {
  explicit Disturbed(std::size_t busy, std::size_t unused) {
    for (std::size_t i = 0; i < kLines; ++i) {
      pressure_advance::ScanLine line;
      line.frame_positions_mm.resize(120);
      if (i < busy) line.lost_frames = 131;
      scan.lines.push_back(line);
      pressure_advance::LineResult result;
      result.used = i >= unused;
      result.reason = result.used ? "" : "only 2 readings";
      analysis.lines.push_back(result);
    }
    analysis.pressure_advance = Measured::CannotTell("scan more of the line");
  }
  pressure_advance::Scan scan;
  pressure_advance::Analysis analysis;
};

TEST(BlameBusyComputer, IsTheFirstWordWhereLostFramesAreTheCause) {
  Disturbed run(8, 8);
  BlameBusyComputer(run.scan, run.analysis);
  const Measured& answer = run.analysis.pressure_advance;
  EXPECT_EQ(answer.verdict(), Verdict::kCannotTell);
  EXPECT_THAT(answer.reason(),
              AllOf(StartsWith("131 of 251 frames never came"), HasSubstr("too busy"),
                    HasSubstr("scan more of the line"), EndsWith("set a lower [scan] speed")));
  EXPECT_THAT(run.analysis.lines[0].reason, StartsWith("131 of 251 frames never came"));
}

TEST(BlameBusyComputer, LeavesAReasonThatItIsNot) {
  Disturbed faint(1, 8);  // seven lines of eight were unreadable with all of their frames there
  BlameBusyComputer(faint.scan, faint.analysis);
  EXPECT_EQ(faint.analysis.pressure_advance.reason(), "scan more of the line");
  Disturbed none(0, 0);
  BlameBusyComputer(none.scan, none.analysis);
  EXPECT_EQ(none.analysis.pressure_advance.reason(), "scan more of the line");
}

TEST(BlameBusyComputer, LeavesAGoodAnswerAsItIs) {
  Disturbed run(8, 8);
  run.analysis.pressure_advance = Measured::Good({0.02, 0.001, {0.018, 0.022}});
  BlameBusyComputer(run.scan, run.analysis);
  EXPECT_TRUE(run.analysis.pressure_advance.good());
}

}  // namespace
}  // namespace trammel::app
