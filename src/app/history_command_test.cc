// trammel history over results as recordings keep them.
#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <nlohmann/json.hpp>
#include <string>

#include "measurement/history.h"
#include "measurement/outcome_file.h"
#include "support/run_trammel.h"

namespace trammel::test {
namespace {

using measurement::Instrument;
using measurement::Outcome;
using nlohmann::json;
using ::testing::AllOf;
using ::testing::HasSubstr;
using ::testing::Not;

class HistoryCommand : public testing::Test {
 protected:
  HistoryCommand() { std::filesystem::create_directory(folder_.path() / "recordings"); }

  static Outcome PressureAdvance() {
    Outcome outcome;
    outcome.provenance = {
        Instrument::kPressureAdvance, "trammel 9.8.7", "2026-01-02T03:04:05Z", {"scan"}};
    outcome.answers = {
        {"pressure_advance", "s", Measured::Good({0.036, 0.0006, {0.0348, 0.0372}})}};
    outcome.notices = {"one line is torn\x1b[2J"};
    return outcome;
  }
  static Outcome Alignment() {
    Outcome outcome;
    outcome.provenance = {Instrument::kPartAlignment, "trammel 9.8.7", "2026-01-03T03:04:05Z", {}};
    for (const char* name : {"part_x", "part_y", "part_z", "part_alpha"}) {
      const bool angle = name == std::string("part_alpha");
      outcome.answers.push_back(
          {name, angle ? "rad" : "mm", Measured::Good({0.002, 0.001, {0, 0.004}})});
    }
    return outcome;
  }
  void Keep(const Outcome& outcome, const std::string& name) const {
    const auto recording = folder_.path() / "recordings" / name;
    std::filesystem::create_directories(recording);
    ASSERT_TRUE(files::KeepOutcome(recording, outcome));
  }
  [[nodiscard]] CommandResult History(const std::string& words) const {
    return RunTrammel("history " + words, folder_.path());
  }

  TemporaryFolder folder_;
};

TEST_F(HistoryCommand, ListsTheNewestFirstWithIntervalUnitAndWhatWasApplied) {
  Keep(PressureAdvance(), "a");
  std::filesystem::create_directory(folder_.path() / "recordings/torn");
  WriteWhole(folder_.path() / "recordings/torn/result.json", "no result");
  Keep(Alignment(), "b");
  std::filesystem::create_directories(folder_.path() / "state/trammel");
  ASSERT_TRUE(files::NoteApplication(folder_.path() / "state/trammel/applied.jsonl",
                                     PressureAdvance(), {"2026-02-02T00:00:00Z", "printer.local"}));
  const CommandResult list = History("list");
  EXPECT_EQ(list.exit_code, 0) << list.output;
  EXPECT_THAT(list.standard_error, HasSubstr("recordings/torn/result.json"));
  EXPECT_EQ(list.standard_output,
            "1    2026-01-03T03:04:05Z  part alignment  good  not applied\n"
            "     part_x  0.0020 mm (95 %: 0.0000 to 0.0040 mm)\n"
            "     part_y  0.0020 mm (95 %: 0.0000 to 0.0040 mm)\n"
            "     part_z  0.0020 mm (95 %: 0.0000 to 0.0040 mm)\n"
            "     and 1 more: trammel history show 1\n"
            "     recordings/b\n"
            "2    2026-01-02T03:04:05Z  pressure advance  good  applied 2026-02-02T00:00:00Z to "
            "printer.local\n"
            "     pressure_advance  0.0360 s (95 %: 0.0348 to 0.0372 s)\n"
            "     recordings/a\n");
  const CommandResult quiet = History("list -q");
  EXPECT_EQ(quiet.standard_error, "");
  EXPECT_EQ(quiet.standard_output, list.standard_output);
  EXPECT_THAT(History("list --color always").standard_output,
              HasSubstr("part alignment  \x1b[32mgood\x1b[0m  not applied\n"));
  EXPECT_THAT(History("list -q --in nowhere").standard_error, HasSubstr("trammel: nowhere"));
  EXPECT_THAT(History("list --last 1").standard_output, Not(HasSubstr("recordings/a")));
  EXPECT_THAT(History("list --instrument pressure_advance").standard_output,
              AllOf(HasSubstr("1    2026-01-02"), Not(HasSubstr("alignment"))));
  const json all = json::parse(History("list --json").standard_output);
  ASSERT_EQ(all.size(), 2u);
  EXPECT_EQ(all[1]["applied"][0]["machine"], "printer.local");
  EXPECT_EQ(all[1]["answers"][0]["value"], 0.036);
  EXPECT_EQ(all[0]["folder"], "recordings/b");
}

TEST_F(HistoryCommand, ShowsAllOfOneAndNoControlCharacters) {
  Keep(PressureAdvance(), "a");
  Keep(Alignment(), "b");
  EXPECT_THAT(History("show").standard_output,
              HasSubstr("part_alpha  2.0000 mm/m (95 %: 0.0000 to 4.0000 mm/m)"));
  EXPECT_THAT(History("show 2 --in recordings").standard_output,
              AllOf(HasSubstr("from scan"), HasSubstr("by trammel 9.8.7"),
                    HasSubstr("one line is torn"), Not(HasSubstr("\x1b"))));
  EXPECT_EQ(json::parse(History("show 2 --json").standard_output)["number"], 2);
}

TEST_F(HistoryCommand, FiltersAndExportsByFilamentWhateverItsName) {
  Outcome outcome = PressureAdvance();
  outcome.subject = {
      "printer.local:7125", "0.40", "=PLA \"100 %\"; x", "extruder1", "17", "215", "60"};
  Keep(outcome, "a");
  outcome.subject.printer = "printer.local:7126";  // two printers of one name
  Keep(outcome, "b");
  Keep(Alignment(), "c");
  EXPECT_THAT(History("list --printer printer.local:7126").standard_output,
              AllOf(HasSubstr("recordings/b"), Not(HasSubstr("recordings/a"))));
  EXPECT_EQ(
      History("export --printer printer.local:7125").standard_output,
      "utc,instrument,printer,nozzle,filament,name,unit,verdict,value,standard_uncertainty,"
      "interval95_lo,interval95_hi,reason,applied_utc,applied_to,program,folder,toolhead,spool,"
      "nozzle_c,bed_c\n"
      "\"2026-01-02T03:04:05Z\",pressure_advance,\"printer.local:7125\",\"0.40\","
      "\"'=PLA \"\"100 %\"\"; x\",\"pressure_advance\",\"s\",good,0.036,0.0006,0.0348,0.0372,"
      "\"\",\"\",\"\",\"trammel 9.8.7\",\"recordings/a\",\"extruder1\",\"17\",\"215\",\"60\"\n");
  EXPECT_THAT(History("show 2").standard_output,
              AllOf(HasSubstr("filament =PLA"), HasSubstr("toolhead extruder1"),
                    HasSubstr("nozzle temperature 215")));
}

TEST_F(HistoryCommand, ComparesTwoResultsAndSaysWhetherAnythingChanged) {
  Outcome outcome = PressureAdvance();
  outcome.subject = {"printer.local", "0.40", "PLA"};
  Keep(outcome, "a");
  outcome.provenance.utc = "2026-01-03T03:04:05Z";
  outcome.subject.nozzle = "0.60";
  outcome.answers[0].value = Measured::Good({0.040, 0.0006, {0.0388, 0.0412}});
  Keep(outcome, "b");
  const CommandResult compared = History("compare");
  EXPECT_EQ(compared.exit_code, 0) << compared.output;
  EXPECT_EQ(compared.standard_output,
            "2    2026-01-02T03:04:05Z  pressure advance  good\n"
            "1    2026-01-03T03:04:05Z  pressure advance  good\n"
            "     another nozzle: 0.40, then 0.60\n"
            "     pressure_advance  +0.0040 s (95 %: +0.0023 to +0.0057 s): it has changed\n");
  const json back = json::parse(History("compare 1 2 --json").standard_output);
  EXPECT_NEAR(back["changes"][0]["difference"]["value"], -0.004, 1e-9);
  EXPECT_EQ(back["changes"][0]["differs"], true);
  EXPECT_THAT(History("compare 2 2").standard_output, HasSubstr("no change that can be told"));
  Keep(Alignment(), "c");
  EXPECT_THAT(History("compare").standard_error,
              HasSubstr("result 2 is of pressure advance and result 1 of part alignment"));
  EXPECT_THAT(History("compare 9").standard_error, HasSubstr("there is no result 9: 3"));
}

TEST_F(HistoryCommand, ShowsHowAResultDiffersFromEarlierOnesOfTheSameThing) {
  Outcome outcome = PressureAdvance();
  outcome.subject = {"printer.local", "0.40", "PLA"};
  for (const double value : {0.036, 0.0365, 0.0355, 0.044}) {
    outcome.provenance.utc[9] += 1;
    outcome.answers[0].value = Measured::Good({value, 0.0006, {value - 0.0012, value + 0.0012}});
    Keep(outcome, outcome.provenance.utc);
  }
  EXPECT_THAT(
      History("show 1").standard_output,
      AllOf(HasSubstr("pressure_advance: +0.0080 s (95 %: "),
            HasSubstr("): it has changed against 0.0360 s, the mean of 3 earlier results")));
  EXPECT_THAT(History("show 2").standard_output, Not(HasSubstr("earlier results")));

  const auto recordings = folder_.path() / "recordings";
  ASSERT_TRUE(files::NoteNozzleChange(recordings, "2026-01-05T12:00:00Z", "another"));
  EXPECT_THAT(History("show 1").standard_output, HasSubstr("the mean of 3 earlier results"));
  // Between the fourth result and the fifth, whatever the clock was then.
  ASSERT_TRUE(files::NoteNozzleChange(recordings, "1970-01-01T00:00:10Z", "printer.local"));
  outcome.provenance.utc[9] += 1;
  Keep(outcome, "new nozzle");
  EXPECT_THAT(History("show 1").standard_output,
              AllOf(Not(HasSubstr("earlier results")),
                    HasSubstr("nozzle was changed 1970-01-01T00:00:10Z")));
  EXPECT_THAT(History("show 2").standard_output, Not(HasSubstr("nozzle was changed")));
}

TEST_F(HistoryCommand, SaysWhatARunLeftOpenAndWhatBecameOfIt) {
  using Step = files::Application::Step;
  const auto applied = folder_.path() / "state/trammel/applied.jsonl";
  std::filesystem::create_directories(applied.parent_path());
  Keep(PressureAdvance(), "a");
  const auto note = [&](const std::string& utc, Step step) {
    ASSERT_TRUE(files::NoteApplication(applied, PressureAdvance(),
                                       {utc, "printer.local", step, 0.031, 0.036}));
  };
  note("t1", Step::kBegun);
  EXPECT_THAT(History("list").standard_output,
              HasSubstr("about to be applied t1 to printer.local, and not noted whether it was: "
                        "trammel doctor tells"));
  note("t2", Step::kNotInForce);
  EXPECT_THAT(History("list").standard_output, HasSubstr("not in force t2 on printer.local"));
  note("t3", Step::kBegun);
  note("t4", Step::kApplied);
  note("t5", Step::kUndoing);
  EXPECT_THAT(History("list").standard_output, HasSubstr("about to be taken back t5"));
  note("t6", Step::kApplied);  // it was not
  EXPECT_THAT(History("list").standard_output, HasSubstr("good  applied t6"));
}

TEST_F(HistoryCommand, SaysWhatIsDue) {
  Outcome outcome = PressureAdvance();
  outcome.subject = {"printer.local", "0.40", "PLA"};
  Keep(outcome, "a");
  const CommandResult due = History("due --age 30");
  EXPECT_EQ(due.exit_code, 0) << due.output;
  EXPECT_THAT(due.standard_output,
              AllOf(HasSubstr("due      pressure advance, printer printer.local:7125, nozzle 0.40, "
                              "filament PLA\n"),
                    HasSubstr("days old, of 30")));
  EXPECT_THAT(History("due --age 36500").standard_output,
              AllOf(HasSubstr("fine"), HasSubstr("its last answer is of 2026-01-02T03:04:05Z")));
  ASSERT_TRUE(files::NoteNozzleChange(folder_.path() / "recordings", "2026-01-05T12:00:00Z",
                                      "printer.local"));
  EXPECT_THAT(History("due --age 36500").standard_output, HasSubstr("the nozzle was changed"));
}

}  // namespace
}  // namespace trammel::test
