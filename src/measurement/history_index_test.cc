#include "measurement/history_index.h"

#include <SQLiteCpp/SQLiteCpp.h>
#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <unistd.h>

#include <fstream>

#include "base/random.h"
#include "files/new_file.h"
#include "measurement/outcome_file.h"
#include "support/temporary_folder.h"

namespace trammel::files {
namespace {

namespace fs = std::filesystem;
using measurement::Instrument;
using measurement::Outcome;
using ::testing::ElementsAre;
using ::testing::HasSubstr;

class HistoryIndex : public ::testing::Test {
 protected:
  static Outcome Found(int n, const std::string& filament = "pla") {
    Outcome outcome;
    outcome.provenance = {Instrument::kPressureAdvance,
                          "trammel 9",
                          fmt::format("2026-01-{:02}T{:02}:00:00Z", 1 + n / 24, n % 24),
                          {"scan"}};
    outcome.answers = {{"pressure_advance", "s", Measured::Good({n * 1e-3, 1e-3, {-1, 1}})}};
    outcome.answers[0].value = Measured::Good({n * 1e-3, 1e-3, {n * 1e-3 - 2e-3, n * 1e-3 + 2e-3}});
    outcome.subject = {"printer.local", "0.40", filament};
    return outcome;
  }
  void Add(int n, const std::string& filament = "pla") const {
    const fs::path recording = folder_.path() / fmt::format("r{}", n);
    fs::create_directory(recording);
    ASSERT_TRUE(KeepOutcome(recording, Found(n, filament)));
    ASSERT_TRUE(
        AppendLine(folder_.path() / kHistoryFile, HistoryLine(Found(n, filament), recording)));
  }
  /// The results as their lines; the error's message where there is one.
  [[nodiscard]] std::vector<std::string> Lines(const HistoryQuery& query = {.last = 10'000}) const {
    const auto history = ReadIndexed(folder_.path(), query);
    if (!history) return {history.error().message};
    std::vector<std::string> lines;
    for (const HistoryEntry& entry : history->entries) {
      lines.push_back(HistoryLine(entry.outcome, entry.folder));
    }
    return lines;
  }
  [[nodiscard]] std::string Line(int n, const std::string& filament = "pla") const {
    return HistoryLine(Found(n, filament), folder_.path() / fmt::format("r{}", n));
  }

  test::TemporaryFolder folder_;
  fs::path index_ = folder_.path() / kIndexFile;
};

TEST_F(HistoryIndex, GivesTheNewestFirstAndFollowsTheHistoryAsItGrows) {
  Add(1);
  EXPECT_THAT(Lines(), ElementsAre(Line(1)));
  Add(3, "petg");
  ASSERT_TRUE(AppendLine(folder_.path() / kHistoryFile, "no result"));
  Add(2);
  EXPECT_THAT(Lines(), ElementsAre(Line(3, "petg"), Line(2), Line(1)));
  EXPECT_THAT(Lines({.last = 1}), ElementsAre(Line(3, "petg")));
  EXPECT_THAT(Lines({.subject = {.filament = "pla"}}), ElementsAre(Line(2), Line(1)));
  const auto history = ReadIndexed(folder_.path(), {});
  ASSERT_TRUE(history) << history.error().message;
  EXPECT_EQ(history->skipped_lines, 1u);
  EXPECT_THAT(history->skipped, ElementsAre(HasSubstr("history.jsonl, line 3")));
}

TEST_F(HistoryIndex, HostileNamesAreNamesAndNothingElse) {
  const std::vector<std::string> names = {"a'; DROP TABLE result; --",
                                          "\"quoted\"",
                                          "100 %",
                                          "a;b#c\\d",
                                          "\xF0\x9F\xA6\x84",
                                          "' OR '1'='1",
                                          std::string(1000, 'x')};
  int n = 0;
  for (const std::string& name : names) Add(++n, name);
  n = 0;
  for (const std::string& name : names) {
    ++n;
    EXPECT_THAT(Lines({.subject = {.filament = name}}), ElementsAre(Line(n, name)));
  }
  EXPECT_EQ(Lines().size(), names.size());
}

TEST_F(HistoryIndex, CutAt200RandomBytesLosesNothing) {
  constexpr int kResults = 40;
  for (int n = 0; n < kResults; ++n) Add(n);
  const std::vector<std::string> whole = Lines();
  ASSERT_EQ(whole.size(), std::size_t{kResults});
  std::string history;
  for (int n = 0; n < kResults; ++n) history += Line(n) + "\n";
  const fs::path path = folder_.path() / kHistoryFile;
  Random random(1018);
  for (int cut = 0; cut < 200; ++cut) {
    // Every fifth time history.jsonl is gone as well: the folders have it all.
    if (cut % 5 == 0) fs::remove(path);
    const auto size = static_cast<double>(fs::file_size(index_));
    const auto at = static_cast<std::uintmax_t>(random.Uniform(0, size));
    fs::resize_file(index_, at);
    EXPECT_EQ(Lines(), whole) << "cut at " << at << " of " << size << " bytes";
    std::ofstream(path, std::ios::binary) << history;
  }
  EXPECT_EQ(Lines(), whole);
}

TEST_F(HistoryIndex, AHistoryThatWasChangedBeforeItsEndIsReadAnew) {
  Add(1);
  Add(2);
  ASSERT_EQ(Lines().size(), 2u);
  ASSERT_TRUE(WriteWholeFile(folder_.path() / kHistoryFile, Line(2) + "\n", IfThere::kReplace));
  fs::remove_all(folder_.path() / "r1");
  EXPECT_THAT(Lines(), ElementsAre(Line(2)));
}

TEST_F(HistoryIndex, AnOlderOneIsMigratedWithAllThatItHas) {
  Add(1);
  ASSERT_EQ(Lines().size(), 1u);
  {
    SQLite::Database database(index_.string(), SQLite::OPEN_READWRITE);
    database.exec(
        "DROP INDEX result_by_filament; ALTER TABLE result DROP COLUMN printer;"
        "ALTER TABLE result DROP COLUMN nozzle; ALTER TABLE result DROP COLUMN filament;"
        "UPDATE result SET program = 'by the older one'; PRAGMA user_version = 1");
  }
  EXPECT_THAT(Lines(), ElementsAre(Line(1)));
  SQLite::Database database(index_.string());
  EXPECT_EQ(database.execAndGet("PRAGMA user_version").getInt(), kIndexVersion);
  EXPECT_EQ(database.execAndGet("SELECT program FROM result").getString(), "by the older one");
}

TEST_F(HistoryIndex, ANewerOnesAndOtherProgramsFilesStayAsTheyAre) {
  Add(1);
  ASSERT_EQ(Lines().size(), 1u);
  for (const auto& [change, sentence] :
       {std::pair{"PRAGMA user_version = 3", "a newer trammel wrote it"},
        std::pair{"PRAGMA application_id = 7", "another program's file"}}) {
    SQLite::Database(index_.string(), SQLite::OPEN_READWRITE).exec(change);
    const auto size = fs::file_size(index_);
    EXPECT_THAT(Lines(), ElementsAre(HasSubstr(sentence)));
    EXPECT_FALSE(RebuildIndex(folder_.path()));
    EXPECT_EQ(fs::file_size(index_), size);
  }
  const auto rebuilt = RebuildIndex(folder_.path(), folder_.path() / "own.db");
  ASSERT_TRUE(rebuilt) << rebuilt.error().message;
  EXPECT_EQ(rebuilt->results, 1u);
  EXPECT_FALSE(RebuildIndex(folder_.path(), folder_.path() / "own.db"));
}

TEST_F(HistoryIndex, WhatCannotBeReadOrWrittenIsAnError) {
  EXPECT_THAT(Lines(), ElementsAre(HasSubstr("there is no such file")));
  EXPECT_FALSE(RebuildIndex(folder_.path() / "nowhere"));
  Add(1);
  fs::create_directory(index_);
  EXPECT_THAT(Lines(), ElementsAre(HasSubstr("another program's file")));
}

}  // namespace
}  // namespace trammel::files
