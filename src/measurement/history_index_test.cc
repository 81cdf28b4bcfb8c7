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
using ::testing::AllOf;
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

TEST_F(HistoryIndex, LiesUnderAnyLinkedFolderButIsNoLinkItself) {
  Add(1);
  const test::TemporaryFolder elsewhere;
  const fs::path home = elsewhere.path() / "home";
  fs::create_directory_symlink(folder_.path().parent_path(), home);  // as /home often is
  const fs::path recordings = elsewhere.path() / "recordings";
  fs::create_directory_symlink(home / folder_.path().filename(), recordings);
  const auto history = ReadIndexed(recordings, {});
  ASSERT_TRUE(history) << history.error().message;
  EXPECT_EQ(history->entries.size(), 1U);
  EXPECT_TRUE(fs::is_regular_file(index_));
  fs::rename(index_, elsewhere.path() / "other.db");
  fs::create_symlink(elsewhere.path() / "other.db", index_);
  EXPECT_FALSE(ReadIndexed(recordings, {}));
}

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

TEST_F(HistoryIndex, AChangeFarBeforeTheEndOfTheHistoryIsSeen) {
  constexpr int kResults = 40;  // 20 kB
  std::string history;
  for (int n = 0; n < kResults; ++n) history += Line(n) + "\n";
  const fs::path path = folder_.path() / kHistoryFile;
  test::WriteWhole(path, history);
  ASSERT_EQ(Lines().size(), std::size_t{kResults});
  const std::string first = Line(0);
  const std::size_t filament = first.rfind("pla");
  ASSERT_NE(filament, std::string::npos);
  const auto kept = fs::last_write_time(path);
  history.replace(filament, 3, "abs");  // as long as before, and by the clock, too
  test::WriteWhole(path, history);
  fs::last_write_time(path, kept);
  EXPECT_EQ(Lines({.subject = {.filament = "abs"}}).size(), 1u);
  EXPECT_EQ(Lines().size(), std::size_t{kResults});
}

// A writer between two writes, or one that was killed and whose line another program completed.
TEST_F(HistoryIndex, ALineThatIsWrittenInPiecesIsReadWhenItIsWhole) {
  Add(1);
  const std::string line = Line(2) + "\n";
  const fs::path path = folder_.path() / kHistoryFile;
  const auto append = [&](const std::string& piece) {
    std::ofstream(path, std::ios::binary | std::ios::app) << piece;
  };
  for (std::size_t cut = 1; cut < line.size(); cut += 37) {
    SCOPED_TRACE(cut);
    fs::remove(index_);
    test::WriteWhole(path, Line(1) + "\n" + line.substr(0, cut));
    const bool whole = cut + 1 == line.size();  // but its line feed
    EXPECT_EQ(Lines().size(), whole ? 2u : 1u);
    EXPECT_EQ(ReadIndexed(folder_.path(), {})->skipped_lines, whole ? 0u : 1u);
    append(line.substr(cut));
    EXPECT_THAT(Lines(), ElementsAre(Line(2), Line(1)));
    EXPECT_EQ(ReadIndexed(folder_.path(), {})->skipped_lines, 0u);
    ASSERT_TRUE(AppendLine(path, Line(3)));
    EXPECT_THAT(Lines(), ElementsAre(Line(3), Line(2), Line(1)));
  }
  append("{\"half\"");
  EXPECT_THAT(ReadIndexed(folder_.path(), {})->skipped,
              ElementsAre(AllOf(HasSubstr("line 4"), HasSubstr("not ended yet"))));
}

TEST_F(HistoryIndex, AResultOfAFolderAloneStandsThereOnceWhenItsLineComes) {
  Add(1);
  const fs::path recording = folder_.path() / "r2";
  fs::create_directory(recording);
  ASSERT_TRUE(KeepOutcome(recording, Found(2)));
  ASSERT_EQ(RebuildIndex(folder_.path())->from_folders, 1u);
  EXPECT_THAT(Lines(), ElementsAre(Line(2), Line(1)));
  ASSERT_TRUE(AppendLine(folder_.path() / kHistoryFile, Line(2)));
  EXPECT_THAT(Lines(), ElementsAre(Line(2), Line(1)));
}

TEST_F(HistoryIndex, HandsOverEachResultOnceWhereTheIndexIsDamagedBelowThem) {
  constexpr int kResults = 10;
  for (int n = 0; n < kResults; ++n) Add(n);
  ASSERT_EQ(Lines().size(), std::size_t{kResults});
  SQLite::Database(index_.string(), SQLite::OPEN_READWRITE)
      .exec("UPDATE result SET line = 'x' WHERE id = 4");
  std::vector<std::string> lines;
  const auto skipped =
      ForEachIndexed(folder_.path(), {.last = 8}, [&](const HistoryEntry& entry, std::size_t) {
        lines.push_back(HistoryLine(entry.outcome, entry.folder));
      });
  ASSERT_TRUE(skipped) << skipped.error().message;
  EXPECT_THAT(lines,
              ElementsAre(Line(9), Line(8), Line(7), Line(6), Line(5), Line(4), Line(3), Line(2)));
}

TEST_F(HistoryIndex, AnOlderOneIsMigratedWithAllThatItHas) {
  Add(1);
  ASSERT_EQ(Lines().size(), 1u);
  {
    SQLite::Database database(index_.string(), SQLite::OPEN_READWRITE);
    database.exec(
        "DROP INDEX result_by_filament; ALTER TABLE result DROP COLUMN printer;"
        "ALTER TABLE result DROP COLUMN nozzle; ALTER TABLE result DROP COLUMN filament;"
        "ALTER TABLE result DROP COLUMN number; ALTER TABLE source RENAME COLUMN hash TO tail_hash;"
        "UPDATE result SET program = 'by the older one'; PRAGMA user_version = 1");
  }
  const fs::path away = folder_.path() / "away";
  fs::rename(folder_.path() / kHistoryFile, away);
  EXPECT_THAT(Lines(), ElementsAre(Line(1)));
  SQLite::Database database(index_.string());
  EXPECT_EQ(database.execAndGet("PRAGMA user_version").getInt(), kIndexVersion);
  EXPECT_EQ(database.execAndGet("SELECT program FROM result").getString(), "by the older one");
  // It may have taken half a line for a whole one.
  fs::rename(away, folder_.path() / kHistoryFile);
  EXPECT_THAT(Lines(), ElementsAre(Line(1)));
  SQLite::Database anew(index_.string());
  EXPECT_EQ(anew.execAndGet("SELECT program FROM result").getString(), "trammel 9");
}

TEST_F(HistoryIndex, ANewerOnesAndOtherProgramsFilesStayAsTheyAre) {
  Add(1);
  ASSERT_EQ(Lines().size(), 1u);
  for (const auto& [change, sentence] :
       {std::pair{"PRAGMA user_version = 4", "a newer trammel wrote it"},
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
