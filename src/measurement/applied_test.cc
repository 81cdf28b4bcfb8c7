#include "measurement/applied.h"

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
using Step = Application::Step;

constexpr auto kInstrument = Instrument::kPressureAdvance;

class Applied : public ::testing::Test {
 protected:
  static Outcome Found(double value_s) {
    Outcome outcome;
    outcome.provenance = {kInstrument, "trammel 9", "2026-01-02T03:04:05Z", {"scan"}};
    outcome.answers = {
        {"value", "s", Measured::Good({value_s, 0.001, {value_s - 0.002, value_s + 0.002}})}};
    outcome.notices = {"not UTF-8: \xff"};
    return outcome;
  }
  void Note(const Outcome& outcome, const Application& application) const {
    ASSERT_TRUE(NoteApplication(path_, outcome, application));
  }
  void Note(const std::string& fingerprint, const Application& application) const {
    ASSERT_TRUE(NoteApplication(path_, kInstrument, fingerprint, application));
  }
  /// Returns the applications of a result.
  [[nodiscard]] std::vector<Application> Of(const Outcome& outcome) const {
    auto all = *AllApplications(path_);
    return all[Fingerprint(outcome)];
  }
  /// Returns the applications on machine "printer".
  [[nodiscard]] std::vector<NotedApplication> All() const {
    return *Applications(path_, kInstrument,
                         [](const std::string& address) { return address == "printer"; });
  }

  test::TemporaryFolder folder_;
  std::filesystem::path path_ = folder_.path() / kAppliedFile;
};

TEST_F(Applied, IsKnownOfEachResult) {
  EXPECT_TRUE(Of(Found(1)).empty());  // the file is not there
  // An applied outcome is read from result.json, or new.
  const auto read = ParseOutcome(ToJson(Found(2)), "r");
  Note(*read, {"2026-01-03T00:00:00Z", "printer.local"});
  ASSERT_TRUE(AppendLine(path_, "torn {"));
  Note(Found(2), {"2026-01-04T00:00:00Z", "printer.local"});
  Note(Found(3), {"2026-01-04T00:00:00Z", "printer.local"});
  ASSERT_EQ(Of(Found(2)).size(), 2u);
  EXPECT_EQ(Of(Found(2))[1].utc, "2026-01-04T00:00:00Z");
  EXPECT_EQ(Of(Found(2))[0].machine, "printer.local");
  EXPECT_TRUE(Of(Found(1)).empty());
}

TEST_F(Applied, IsBegunUntilItIsNotedAsDone) {
  Note(Found(2), {"2026-01-03T00:00:00Z", "printer", Step::kBegun, 0.04, 0.05});
  ASSERT_EQ(Of(Found(2)).size(), 1u);
  EXPECT_EQ(Of(Found(2))[0].step, Step::kBegun);
  Note(Found(2), {"2026-01-03T00:00:01Z", "printer"});
  ASSERT_EQ(Of(Found(2)).size(), 1u);
  EXPECT_EQ(Of(Found(2))[0].step, Step::kApplied);
  EXPECT_EQ(Of(Found(2))[0].before, 0.04);
  // Notes on another machine have no effect.
  Note(Found(2), {"2026-01-04T00:00:00Z", "other", Step::kBegun});
  Note(Found(2), {"2026-01-04T00:00:01Z", "printer"});
  ASSERT_EQ(Of(Found(2)).size(), 3u);
  EXPECT_EQ(Of(Found(2))[1].step, Step::kBegun);
}

TEST_F(Applied, TheLastSaysWhatToGoBackTo) {
  EXPECT_TRUE(All().empty());
  Note("a", {"t1", "printer", Step::kBegun, 0.03, 0.04});
  Note("a", {"t2", "printer", Step::kApplied, {}, 0.04});
  Note("", {"t3", "printer", Step::kBegun, 0.04, 0.05});
  ASSERT_TRUE(NoteApplication(path_, Instrument::kTap, "x", {"t4", "printer"}));
  Note("", {"t5", "other", Step::kApplied, 0.1, 0.2});
  ASSERT_EQ(All().size(), 2u);  // the last was typed, and may not have come into force
  EXPECT_EQ(All()[0].application.before, 0.03);
  EXPECT_EQ(All()[1].application.before, 0.04);
  EXPECT_EQ(All()[1].application.step, Step::kBegun);
  Note("", {"t6", "printer", Step::kApplied, {}, 0.05});
  EXPECT_EQ(All()[1].application.before, 0.04);
  EXPECT_EQ(All()[1].application.utc, "t6");
  Note("", {"t7", "printer", Step::kUndone, 0.04, 0.05});
  EXPECT_EQ(All()[1].application.step, Step::kUndone);
  EXPECT_EQ(All()[1].application.value, 0.05);
}

TEST_F(Applied, WhatEachPartHadBeforeIsThatOfTheBeginning) {
  const std::map<std::string, double> before = {{"extruder", 0.03}, {"extruder_stepper b", 0.01}};
  Note("a", {"t1", "printer", Step::kBegun, 0.03, 0.04, before});
  Note("a", {"t2", "printer", Step::kApplied, {}, 0.04});
  ASSERT_EQ(All().size(), 1U);
  EXPECT_EQ(All().front().application.before_each, before);
}

}  // namespace
}  // namespace trammel::files
