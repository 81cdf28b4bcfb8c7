#include "pressure_advance/commands/kept_result.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <chrono>
#include <filesystem>
#include <limits>
#include <string>

#include "measurement/outcome_file.h"
#include "pressure_advance/commands/analysis_run.h"
#include "pressure_advance/commands/apply_command.h"
#include "pressure_advance/commands/conditions_run.h"
#include "pressure_advance/pattern/pattern.h"
#include "pressure_advance/pattern/pattern_config.h"
#include "pressure_advance/pattern/pattern_geometry.h"
#include "support/temporary_folder.h"

namespace trammel::app {
namespace {

using ::testing::AllOf;
using ::testing::ElementsAre;
using ::testing::HasSubstr;

pressure_advance::Analysis AnalysisOf(const Measured& answer) {
  pressure_advance::Analysis analysis;
  analysis.pressure_advance = answer;
  analysis.notices = {"one line is torn"};
  return analysis;
}

Result<void> Keep(const pressure_advance::Analysis& analysis, const std::filesystem::path& folder) {
  return KeepInRecording(folder, ResultOf(analysis, folder));
}

TEST(KeptResult, IsWhatApplyTakesWithoutLookingAtTheRecordingAgain) {
  const test::TemporaryFolder folder;
  const auto recording = folder.path() / "pressure_advance-20260102T030405Z";
  std::filesystem::create_directory(recording);
  const auto analysis = AnalysisOf(Measured::Good({0.036, 0.0005, {0.035, 0.0371}}));
  ASSERT_TRUE(Keep(analysis, recording));
  for (const auto& path : {recording, recording / "result.json"}) {
    ::testing::internal::CaptureStdout();         // must be a single JSON object
    const auto value = ValueFrom(path.string());  // there is no scan.json in the folder
    EXPECT_EQ(::testing::internal::GetCapturedStdout(), "");
    ASSERT_TRUE(value) << value.error().message;
    EXPECT_EQ(value->value_s, 0.036);
    ASSERT_TRUE(value->measured);
    EXPECT_EQ(value->measured->interval95.hi, 0.0371);
    ASSERT_TRUE(value->result);
    EXPECT_THAT(value->result->notices, ElementsAre("one line is torn"));
  }
}

TEST(KeptResult, HasTheFlowRatioBesideTheAnswerOnlyWhereItIsGood) {
  const test::TemporaryFolder folder;
  auto analysis = AnalysisOf(Measured::Good({0.036, 0.0005, {0.035, 0.0371}}));
  analysis.flow.emplace().ratio = Measured::Good({1.03, 0.01, {1.01, 1.05}});
  ASSERT_TRUE(Keep(analysis, folder.path()));
  const auto kept = files::ReadOutcome(folder.path(), measurement::Instrument::kPressureAdvance);
  ASSERT_TRUE(kept) << kept.error().message;
  ASSERT_NE(kept->Find("flow_ratio"), nullptr);
  EXPECT_EQ(kept->Find("flow_ratio")->value.quantity().value, 1.03);
  EXPECT_EQ(kept->answers.front().name, "pressure_advance");
  analysis.flow->ratio = Measured::CannotTell("no scale");
  const auto without = ResultOf(analysis, "r").outcome;
  EXPECT_EQ(without.Find("flow_ratio"), nullptr);
  EXPECT_EQ(without.verdict(), Verdict::kGood);
}

TEST(KeptResult, ThatIsOlderThanItsRecordingIsNotTaken) {
  const test::TemporaryFolder folder;
  const auto recording = folder.path() / "r/";
  std::filesystem::create_directory(recording);
  ASSERT_TRUE(Keep(AnalysisOf(Measured::Good({0.036, 0.0005, {0.035, 0.0371}})), recording));
  test::WriteWhole(recording / "scan.json", "{}");
  std::filesystem::last_write_time(
      recording / "scan.json",
      std::filesystem::last_write_time(recording / "result.json") + std::chrono::seconds(2));
  const auto value = ValueFrom(recording.string());
  ASSERT_FALSE(value);
  EXPECT_THAT(value.error().message, HasSubstr("scan.json"));
}

TEST(KeptResult, WithoutAGoodVerdictGivesNothingToApply) {
  const test::TemporaryFolder folder;
  ASSERT_TRUE(Keep(AnalysisOf(Measured::CannotTell("the lines are too alike")), folder.path()));
  const auto value = ValueFrom(folder.path().string());
  ASSERT_FALSE(value);
  EXPECT_EQ(value.error().kind, ErrorKind::kMeasurement);
  EXPECT_THAT(value.error().message,
              AllOf(HasSubstr("cannot tell"), HasSubstr("the lines are too alike")));
}

TEST(KeptResult, BeyondWhatAPrinterTakesIsRefused) {
  for (const Quantity& absurd : {Quantity{-0.02, 0.001, {-0.022, -0.018}},
                                 Quantity{0.02, 0.9, {-10.5, 1}}, Quantity{9, 1, {7, 11}}}) {
    const test::TemporaryFolder folder;
    ASSERT_TRUE(Keep(AnalysisOf(Measured::Good(absurd)), folder.path()));
    const auto value = ValueFrom(folder.path().string());
    ASSERT_FALSE(value);
    EXPECT_THAT(value.error().message,
                AllOf(HasSubstr("result.json"), HasSubstr("must lie within 0 ... 10 s")));
  }
}

TEST(KeptResult, IsReadFromAnyOrdinaryFileAndWhateverElseIsNamed) {
  const test::TemporaryFolder folder;
  const auto recording = folder.path() / "r";
  std::filesystem::create_directory(recording);
  ASSERT_TRUE(Keep(AnalysisOf(Measured::Good({0.036, 0.0005, {0.035, 0.0371}})), recording));
  std::filesystem::copy(recording / "result.json", folder.path() / "answer");
  EXPECT_TRUE(ValueFrom((folder.path() / "answer").string()));
  std::filesystem::create_directory(folder.path() / "empty");
  std::filesystem::create_symlink("nowhere", folder.path() / "link");
  test::WriteWhole(folder.path() / "printed", R"({"format": 1, "verdict": "good"})");
  const auto why = [](const std::filesystem::path& path) {
    const auto value = ValueFrom(path.string());
    return value ? "" : value.error().message;
  };
  EXPECT_THAT(why(folder.path() / "empty"), HasSubstr("neither result.json nor scan.json"));
  EXPECT_THAT(why(folder.path() / "link"), HasSubstr("is a link to nowhere"));
  EXPECT_THAT(why(folder.path() / "printed"), HasSubstr("what --json printed"));
  EXPECT_THAT(why("/dev/null"), HasSubstr("is not a regular file"));
  for (const char* text : {"nosuch", "", "0.1:0.2:0.1", "nan", "11"}) {
    EXPECT_THAT(why(text), HasSubstr("is neither one pressure advance")) << text;
  }
  EXPECT_EQ(why("0.04"), "");
}

TEST(KeptResult, OfAnotherInstrumentIsNamed) {
  const test::TemporaryFolder folder;
  measurement::Outcome outcome;
  outcome.provenance.instrument = measurement::Instrument::kTap;
  outcome.answers = {{"contact_height", "mm", Measured::Good({0.1, 0.01, {0.08, 0.12}})}};
  ASSERT_TRUE(files::KeepOutcome(folder.path(), outcome));
  const auto value = ValueFrom(folder.path().string());
  ASSERT_FALSE(value);
  EXPECT_THAT(value.error().message, HasSubstr("a result of taps, not of pressure advance"));
}

using pressure_advance::PatternConditions;
using pressure_advance::PatternConfig;

constexpr procedure::Reach kReach{{0, 0, 0}, {250, 250, 250}};

files::Config Settings() {
  files::Config config;
  config.pattern.material = "pla";
  ApplyPreset(pressure_advance::kDefaultPreset, config.pattern, config.scan);
  return config;
}

std::string Refusal(const AskedConditions& asked) {
  const auto conditions = CombineConditions(asked, Settings().pattern);
  return conditions ? "" : conditions.error().message;
}

TEST(Conditions, AreEachSpeedWithEachAcceleration) {
  const auto conditions = CombineConditions({{60, 100, 150}, {1500, 3000}, {}}, Settings().pattern);
  ASSERT_TRUE(conditions.has_value()) << conditions.error().message;
  ASSERT_EQ(conditions->size(), 6U);
  EXPECT_EQ((*conditions)[1].fast_speed_mm_s, 100);
  EXPECT_EQ((*conditions)[1].acceleration_mm_s2, 1500);
  EXPECT_EQ((*conditions)[5].fast_speed_mm_s, 150);
  EXPECT_EQ((*conditions)[5].acceleration_mm_s2, 3000);
}

TEST(Conditions, ThatAreNoneAreRefusedByName) {
  constexpr double kNaN = std::numeric_limits<double>::quiet_NaN();
  EXPECT_THAT(Refusal({{60}, {}, {}}), HasSubstr("1 combination(s)"));
  EXPECT_THAT(Refusal({{60, 80, 100, 120}, {1000, 2000, 3000}, {}}), HasSubstr("12 combin"));
  EXPECT_THAT(Refusal({{60, 60}, {}, {}}), HasSubstr("twice"));
  EXPECT_THAT(Refusal({{60, kNaN}, {}, {}}), HasSubstr("--speeds nan"));
  EXPECT_THAT(Refusal({{60, 100}, {-1}, {}}), HasSubstr("--accelerations -1"));
  EXPECT_THAT(Refusal({{60, 0}, {}, {}}), HasSubstr("--speeds 0"));
  EXPECT_THAT(Refusal({{5, 100}, {}, {}}), HasSubstr("10 mm/s"));
  EXPECT_THAT(Refusal({{60, 150}, {}, 12}), HasSubstr("--max-flow"));
  EXPECT_THAT(Refusal({{60, 150}, {}, kNaN}), HasSubstr("--max-flow nan"));
  EXPECT_EQ(Refusal({{60, 100}, {}, 12}), "");
}

TEST(Conditions, ArePrintedAndScannedAsTheirPlansSay) {
  const files::Config config = Settings();
  const auto conditions = CombineConditions({{60, 150}, {3000, 5000}, {}}, config.pattern);
  ASSERT_TRUE(conditions.has_value());
  const auto laid = LayConditions(*conditions, config, kReach);
  ASSERT_TRUE(laid.has_value()) << laid.error().message;
  const auto layout = LayOut(*laid);
  for (const pressure_advance::Move& move : layout.moves) {
    if (move.kind != pressure_advance::MoveKind::kLine || move.segment != 1) continue;
    EXPECT_EQ(move.speed_mm_s,
              (*conditions)[static_cast<std::size_t>(move.pattern)].fast_speed_mm_s);
  }
  const auto plan = PlanOfPattern(layout, *laid, 2, "pattern.gcode");
  EXPECT_EQ(plan.acceleration_mm_s2, 5000);
  EXPECT_EQ(plan.segments[1].speed_mm_s, 60);
  EXPECT_EQ(plan.segments[0].speed_mm_s, 10);
  ASSERT_EQ(plan.lines.size(), 10U);
  for (const auto& line : plan.lines) EXPECT_EQ(line.pattern, 0);
  const std::string gcode = WriteGcode(layout, *laid);
  EXPECT_THAT(gcode, HasSubstr("needs a printer that is allowed 150 mm/s and 5000 mm/s^2"));
  const std::size_t third = gcode.find("; frame of pattern 2");
  EXPECT_THAT(gcode.substr(third, 80), HasSubstr("ACCEL=5000"));
}

using ::testing::EndsWith;
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

}  // namespace
}  // namespace trammel::app
