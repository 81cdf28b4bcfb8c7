#include "pressure_advance/commands/kept_result.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <chrono>
#include <filesystem>

#include "measurement/outcome_file.h"
#include "pressure_advance/commands/apply_command.h"
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
    ::testing::internal::CaptureStdout();         // which may hold one JSON object and nothing else
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

}  // namespace
}  // namespace trammel::app
