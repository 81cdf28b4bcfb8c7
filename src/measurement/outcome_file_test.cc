#include "measurement/outcome_file.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <nlohmann/json.hpp>

#include "support/temporary_folder.h"

namespace trammel::files {
namespace {

using measurement::Answer;
using measurement::Instrument;
using measurement::Outcome;
using ::testing::AllOf;
using ::testing::ElementsAre;
using ::testing::HasSubstr;

Outcome GoodOutcome() {
  Outcome outcome;
  outcome.provenance = {
      Instrument::kToolOffset, "trammel 9.8.7", "2026-01-02T03:04:05Z", {"a.png", "b.png"}};
  outcome.answers = {{"tool_1_dx", "mm", Measured::Good({0.125, 0.001, {0.123, 0.1271}})},
                     {"tool_1_dy", "mm", Measured::Good({-1e-7, 0, {-1e-7, -1e-7}})}};
  outcome.notices = {"the sheet shrank"};
  return outcome;
}

std::string FaultOf(const nlohmann::json& json) {
  const auto read = ParseOutcome(json.dump(), "r.json");
  return read ? "" : read.error().message;
}

TEST(OutcomeFile, GivesBackWhatWasWrittenToTheLastBit) {
  const Outcome outcome = GoodOutcome();
  const auto read = ParseOutcome(ToJson(outcome, {{"teeth", 7}}), "r.json");
  ASSERT_TRUE(read) << read.error().message;
  EXPECT_EQ(read->provenance.instrument, Instrument::kToolOffset);
  EXPECT_EQ(read->provenance.program, "trammel 9.8.7");
  EXPECT_EQ(read->provenance.utc, "2026-01-02T03:04:05Z");
  EXPECT_THAT(read->provenance.sources, ElementsAre("a.png", "b.png"));
  EXPECT_THAT(read->notices, ElementsAre("the sheet shrank"));
  ASSERT_EQ(read->answers.size(), 2u);
  const Quantity& quantity = read->Find("tool_1_dx")->value.quantity();
  EXPECT_EQ(quantity.value, 0.125);
  EXPECT_EQ(quantity.standard_uncertainty, 0.001);
  EXPECT_EQ(quantity.interval95.hi, 0.1271);
  EXPECT_EQ(read->Find("tool_1_dy")->value.quantity().value, -1e-7);
  EXPECT_EQ(read->Find("tool_2_dx"), nullptr);
  EXPECT_EQ(read->verdict(), Verdict::kGood);
}

TEST(OutcomeFile, TheWorstAnswerIsTheVerdictAndEachReasonIsSaidOnce) {
  Outcome outcome = GoodOutcome();
  outcome.answers.push_back({"a", "mm", Measured::CannotTell("too few lines")});
  outcome.answers.push_back({"b", "mm", Measured::CannotTell("too few lines")});
  EXPECT_EQ(outcome.verdict(), Verdict::kCannotTell);
  outcome.answers.push_back({"c", "mm", Measured::Refused("torn")});
  const auto read = ParseOutcome(ToJson(outcome), "r.json");
  ASSERT_TRUE(read) << read.error().message;
  EXPECT_EQ(read->verdict(), Verdict::kRefused);
  EXPECT_EQ(read->reason(), "too few lines; torn");
  EXPECT_EQ(Outcome{}.verdict(), Verdict::kRefused);
  EXPECT_EQ(Outcome{}.reason(), "nothing was measured");
}

TEST(OutcomeFile, NoValueStandsBesideAVerdictThatIsNotGoodAndNoneIsMissing) {
  const auto good = nlohmann::json::parse(ToJson(GoodOutcome()));
  EXPECT_EQ(FaultOf(good), "");
  const struct {
    const char* at;
    nlohmann::json value;
    const char* fault;
  } rows[] = {
      {"/answers/0/verdict", "cannot_tell", "answers[0].value stands beside a verdict that is not"},
      {"/answers/1/standard_uncertainty", nullptr, "answers[1].standard_uncertainty is missing"},
      {"/answers/0/interval95", {0.2, 0.3}, "does not hold the value"},
      {"/answers/0/interval95", {-7, 7}, "answers[0].interval95 is 14 wide"},
      {"/answers/0/interval95", {0.125, 0.125}, "no standard uncertainty of 0.001"},
      {"/answers/0/standard_uncertainty", 0, "no standard uncertainty of 0"},
      {"/answers/0/standard_uncertainty", -0.1, "standard_uncertainty"},
      {"/answers/1/name", "tool_1_dx", "tool_1_dx stands there twice"},
      {"/verdict", "refused", "verdict is refused, but that of the answers is good"},
      {"/instrument", "sundial", "instrument"},
      {"/sources", {1}, "sources"},
      {"/format", 2, "format"}};
  for (const auto& row : rows) {
    auto json = good;
    json[nlohmann::json::json_pointer(row.at)] = row.value;
    EXPECT_THAT(FaultOf(json), AllOf(HasSubstr("r.json"), HasSubstr(row.fault))) << row.at;
  }
  auto one_degree_of_freedom = good;
  one_degree_of_freedom["answers"][0]["interval95"] = {0.125 - 0.0127, 0.125 + 0.0127};
  EXPECT_EQ(FaultOf(one_degree_of_freedom), "");
}

TEST(OutcomeFile, KeepsTheSubjectAndPassesOverWhatANewerProgramNotes) {
  Outcome outcome = GoodOutcome();
  outcome.subject = {"printer.local", "0.40", "PLA", "extruder1", "17", "215", "60"};
  auto json = nlohmann::json::parse(ToJson(outcome));
  json["subject"]["humidity"] = 0.4;
  const auto read = ParseOutcome(json.dump(), "r.json");
  ASSERT_TRUE(read) << read.error().message;
  EXPECT_EQ(read->subject, outcome.subject);
  json["subject"]["spool"] = 17;
  EXPECT_THAT(FaultOf(json), HasSubstr("subject.spool"));
  json["subject"]["spool"] = std::string(1001, '7');
  EXPECT_THAT(FaultOf(json), AllOf(HasSubstr("subject.spool"), HasSubstr("1001 bytes")));
}

TEST(OutcomeFile, WhatJsonPrintedIsCalledByItsName) {
  EXPECT_THAT(FaultOf({{"format", 1}, {"verdict", "good"}, {"pressure_advance_s", 0.04}}),
              AllOf(HasSubstr("r.json"), HasSubstr("--json printed"), HasSubstr("--result")));
  EXPECT_THAT(FaultOf({{"format", 1}}), HasSubstr("instrument is missing"));
}

TEST(OutcomeFile, AnotherInstrumentsResultIsNamedAndNothingForeignIsReplaced) {
  const test::TemporaryFolder folder;
  ASSERT_TRUE(KeepOutcome(folder.path(), GoodOutcome()));
  ASSERT_TRUE(KeepOutcome(folder.path(), GoodOutcome()));  // the same recording once more
  ASSERT_TRUE(ReadOutcome(folder.path(), Instrument::kToolOffset));
  ASSERT_TRUE(ReadOutcome(folder.path() / kResultFile, Instrument::kToolOffset));
  const auto other = ReadOutcome(folder.path(), Instrument::kPressureAdvance);
  ASSERT_FALSE(other);
  EXPECT_THAT(other.error().message,
              HasSubstr("is a result of tool offsets, not of pressure advance"));
  Outcome tap = GoodOutcome();
  tap.provenance.instrument = Instrument::kTap;
  EXPECT_FALSE(KeepOutcome(folder.path(), tap));
  test::WriteWhole(folder.path() / kResultFile, "my own notes");
  const auto refused = KeepOutcome(folder.path(), GoodOutcome());
  ASSERT_FALSE(refused);
  EXPECT_THAT(refused.error().message, HasSubstr("nothing was written over it"));
  EXPECT_EQ(test::ReadWhole(folder.path() / kResultFile), "my own notes");
}

}  // namespace
}  // namespace trammel::files
