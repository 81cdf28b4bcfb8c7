#include "measurement/history.h"

#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <map>
#include <string>

#include "files/new_file.h"
#include "measurement/outcome_file.h"
#include "support/temporary_folder.h"

namespace trammel::files {
namespace {

using measurement::Instrument;
using measurement::Outcome;
using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::IsEmpty;

class ResultHistory : public ::testing::Test {
 protected:
  static Outcome Found(double value_s, Instrument instrument = Instrument::kPressureAdvance) {
    Outcome outcome;
    outcome.provenance = {instrument, "trammel 9", "2026-01-02T03:04:05Z", {"scan"}};
    outcome.answers = {
        {"value", "s", Measured::Good({value_s, 0.001, {value_s - 0.002, value_s + 0.002}})}};
    outcome.notices = {"not UTF-8: \xff"};
    return outcome;
  }
  void Add(const std::string& line) const { ASSERT_TRUE(AppendLine(path_, line)); }
  [[nodiscard]] std::vector<double> Values(const HistoryQuery& query = {}) const {
    std::vector<double> values;
    const auto history = ReadHistory(path_, query);
    if (!history) return values;
    for (const HistoryEntry& entry : history->entries) {
      values.push_back(entry.outcome.answers.front().value.quantity().value);
    }
    return values;
  }

  test::TemporaryFolder folder_;
  std::filesystem::path path_ = folder_.path() / "history.jsonl";
};

TEST_F(ResultHistory, GivesTheNewestFirstAndNoMoreThanIsAskedFor) {
  for (int i = 1; i <= 5; ++i) Add(HistoryLine(Found(i), fmt::format("recordings/{}", i)));
  Add(HistoryLine(Found(6, Instrument::kPartAlignment), "align"));
  EXPECT_THAT(Values(), ElementsAre(6, 5, 4, 3, 2, 1));
  EXPECT_THAT(Values({.last = 2}), ElementsAre(6, 5));
  EXPECT_THAT(Values({.last = 2, .instrument = Instrument::kPressureAdvance}), ElementsAre(5, 4));
  EXPECT_THAT(Values({.last = 0}), IsEmpty());
  EXPECT_EQ(ReadHistory(path_, {})->entries[1].folder, "recordings/5");
}

TEST_F(ResultHistory, OrdersByTheTimeThatResultsStateAndThenByLine) {
  const auto at = [](double value, const char* utc) {
    Outcome outcome = Found(value);
    outcome.provenance.utc = utc;
    return HistoryLine(outcome, "r");
  };
  Add(at(1, "2026-03-01T00:00:00Z"));
  Add(at(2, "2026-01-01T00:00:00Z"));  // a folder that came later
  Add(at(3, "2026-01-01T00:00:00Z"));
  EXPECT_THAT(Values(), ElementsAre(1, 3, 2));
  EXPECT_THAT(Values({.last = 2}), ElementsAre(1, 3));
}

TEST_F(ResultHistory, NamesAndPassesOverWhatIsNoResult) {
  Add(HistoryLine(Found(1), "r"));
  std::string contradicting = HistoryLine(Found(2), "r");
  contradicting.replace(contradicting.find("good"), 4, "refused");
  for (const std::string& bad :
       {std::string("{\"format\": 1"), std::string("[]"), contradicting, ToJson(Found(3)),
        std::string("\x1b[2J\0\xff", 6), std::string(2 << 20, 'x'), std::string(100'000, '[')}) {
    std::string line = bad;
    std::erase(line, '\n');
    Add(line);
  }
  Add(HistoryLine(Found(9), "r"));
  const auto history = ReadHistory(path_, {});
  ASSERT_TRUE(history) << history.error().message;
  EXPECT_THAT(Values(), ElementsAre(9, 1));
  EXPECT_EQ(history->skipped_lines, 7u);
  ASSERT_EQ(history->skipped.size(), 7u);
  EXPECT_THAT(history->skipped[0], HasSubstr("history.jsonl, line 2"));
  EXPECT_THAT(history->skipped[3], HasSubstr("folder is missing"));
  EXPECT_THAT(history->skipped[5], HasSubstr("line 7: is longer than"));
  for (int i = 0; i < 100; ++i) Add("{}");
  EXPECT_EQ(ReadHistory(path_, {})->skipped.size(), 10u);
  EXPECT_EQ(ReadHistory(path_, {})->skipped_lines, 107u);
}

TEST_F(ResultHistory, AFileThatIsNoneIsAnError) {
  EXPECT_THAT(ReadHistory(path_, {}).error().message, HasSubstr("there is no such file"));
  EXPECT_THAT(ReadHistory(folder_.path(), {}).error().message, HasSubstr("not an ordinary file"));
  EXPECT_THAT(ReadHistory("/dev/zero", {}).error().message, HasSubstr("not an ordinary file"));
  test::WriteWhole(path_, "");
  EXPECT_THAT(Values(), IsEmpty());
}

TEST_F(ResultHistory, KnowsWhichOfTheResultsWereApplied) {
  const auto applied = folder_.path() / "applied.jsonl";
  Add(HistoryLine(Found(1), "r"));
  Add(HistoryLine(Found(2), "r"));
  auto history = *ReadHistory(path_, {});
  ASSERT_TRUE(AddApplications(applied, history));  // not there: nothing was applied
  EXPECT_THAT(history.entries[0].applied, IsEmpty());
  // What is applied is read from result.json, or was just found.
  const auto read = ParseOutcome(ToJson(Found(2)), "r");
  ASSERT_TRUE(NoteApplication(applied, *read, {"2026-01-03T00:00:00Z", "printer.local"}));
  ASSERT_TRUE(AppendLine(applied, "torn {"));
  ASSERT_TRUE(NoteApplication(applied, Found(2), {"2026-01-04T00:00:00Z", "printer.local"}));
  ASSERT_TRUE(NoteApplication(applied, Found(3), {"2026-01-04T00:00:00Z", "printer.local"}));
  history = *ReadHistory(path_, {});
  ASSERT_TRUE(AddApplications(applied, history));
  ASSERT_EQ(history.entries[0].applied.size(), 2u);
  EXPECT_EQ(history.entries[0].applied[1].utc, "2026-01-04T00:00:00Z");
  EXPECT_EQ(history.entries[0].applied[0].machine, "printer.local");
  EXPECT_THAT(history.entries[1].applied, IsEmpty());
}

TEST_F(ResultHistory, WhatWasBegunIsSaidUntilItIsNotedAsDone) {
  const auto applied = folder_.path() / "applied.jsonl";
  const auto noted = [&] {
    History history;
    history.entries.push_back({Found(2), "a"});
    EXPECT_TRUE(AddApplications(applied, history));
    return history.entries[0].applied;
  };
  ASSERT_TRUE(
      NoteApplication(applied, Found(2),
                      {"2026-01-03T00:00:00Z", "printer", Application::Step::kBegun, 0.04, 0.05}));
  ASSERT_EQ(noted().size(), 1u);
  EXPECT_EQ(noted()[0].step, Application::Step::kBegun);
  EXPECT_EQ(noted()[0].before, 0.04);
  ASSERT_TRUE(NoteApplication(applied, Found(2), {"2026-01-03T00:00:01Z", "printer"}));
  ASSERT_EQ(noted().size(), 1u);
  EXPECT_EQ(noted()[0].step, Application::Step::kApplied);
  EXPECT_EQ(noted()[0].before, 0.04);
  // Of another machine it says nothing.
  ASSERT_TRUE(NoteApplication(applied, Found(2),
                              {"2026-01-04T00:00:00Z", "other", Application::Step::kBegun}));
  ASSERT_TRUE(NoteApplication(applied, Found(2), {"2026-01-04T00:00:01Z", "printer"}));
  ASSERT_EQ(noted().size(), 3u);
  EXPECT_EQ(noted()[1].step, Application::Step::kBegun);
}

TEST_F(ResultHistory, TheLastApplicationSaysWhatToGoBackTo) {
  const auto applied = folder_.path() / "applied.jsonl";
  constexpr auto kInstrument = Instrument::kPressureAdvance;
  const auto all = [&] {
    return *Applications(applied, kInstrument,
                         [](const std::string& address) { return address == "printer"; });
  };
  const auto last = [&] { return std::optional(all().back()); };
  EXPECT_TRUE(all().empty());
  const auto note = [&](const std::string& fingerprint, const Application& application) {
    ASSERT_TRUE(NoteApplication(applied, kInstrument, fingerprint, application));
  };
  note("a", {"t1", "printer", Application::Step::kBegun, 0.03, 0.04});
  note("a", {"t2", "printer", Application::Step::kApplied, {}, 0.04});
  note("", {"t3", "printer", Application::Step::kBegun, 0.04, 0.05});
  ASSERT_TRUE(NoteApplication(applied, Instrument::kTap, "x", {"t4", "printer"}));
  note("", {"t5", "other", Application::Step::kApplied, 0.1, 0.2});
  ASSERT_EQ(all().size(), 2u);  // the last was typed, and may not have come into force
  EXPECT_EQ(all()[0].application.before, 0.03);
  EXPECT_EQ(last()->application.before, 0.04);
  EXPECT_EQ(last()->application.step, Application::Step::kBegun);
  note("", {"t6", "printer", Application::Step::kApplied, {}, 0.05});
  EXPECT_EQ(last()->application.before, 0.04);
  EXPECT_EQ(last()->application.utc, "t6");
  note("", {"t7", "printer", Application::Step::kUndone, 0.04, 0.05});
  EXPECT_EQ(last()->application.step, Application::Step::kUndone);
  EXPECT_EQ(last()->application.value, 0.05);
}

TEST_F(ResultHistory, WhatEachPartHadBeforeIsThatOfTheBeginning) {
  const auto applied = folder_.path() / "applied.jsonl";
  constexpr auto kInstrument = Instrument::kPressureAdvance;
  const auto note = [&](const Application& application) {
    ASSERT_TRUE(NoteApplication(applied, kInstrument, "a", application));
  };
  const std::map<std::string, double> before = {{"extruder", 0.03}, {"extruder_stepper b", 0.01}};
  note({"t1", "printer", Application::Step::kBegun, 0.03, 0.04, before});
  note({"t2", "printer", Application::Step::kApplied, {}, 0.04});
  const auto noted = Applications(applied, kInstrument, [](const std::string&) { return true; });
  ASSERT_TRUE(noted);
  ASSERT_EQ(noted->size(), 1U);
  EXPECT_EQ(noted->front().application.before_each, before);
}

}  // namespace
}  // namespace trammel::files
