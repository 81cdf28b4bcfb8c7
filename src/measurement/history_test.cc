#include "measurement/history.h"

#include <SQLiteCpp/SQLiteCpp.h>
#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <string>

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
using ::testing::IsEmpty;

class ResultHistory : public ::testing::Test {
 protected:
  static Outcome Found(int n, const std::string& filament = "pla") {
    Outcome outcome;
    outcome.provenance = {Instrument::kPressureAdvance,
                          "trammel 9",
                          fmt::format("2026-01-{:02}T{:02}:00:00Z", 1 + n / 24, n % 24),
                          {"scan"}};
    outcome.answers = {{"pressure_advance", "s", Measured::Good({n * 1., 1, {n - 2., n + 2.}})}};
    outcome.subject = {"printer.local", "0.40", filament};
    outcome.notices = {"not UTF-8: \xff"};
    return outcome;
  }
  [[nodiscard]] fs::path FolderOf(int n) const { return folder_.path() / fmt::format("r{}", n); }
  void Keep(const Outcome& outcome, int n) const {
    fs::create_directory(FolderOf(n));
    ASSERT_TRUE(KeepOutcome(FolderOf(n), outcome));
  }
  void Add(int n, const std::string& filament = "pla") const { Keep(Found(n, filament), n); }
  [[nodiscard]] History Read(const HistoryQuery& query = {}) const {
    auto history = ReadHistory(folder_.path(), query);
    EXPECT_TRUE(history) << history.error().message;
    return history ? std::move(*history) : History{};
  }
  [[nodiscard]] std::vector<double> Values(const HistoryQuery& query = {}) const {
    std::vector<double> values;
    for (const HistoryEntry& entry : Read(query).entries) {
      values.push_back(entry.outcome.answers.front().value.quantity().value);
    }
    return values;
  }

  test::TemporaryFolder folder_;
  fs::path file_ = folder_.path() / kHistoryFile;
};

TEST_F(ResultHistory, HasTheNewestFirstAndFollowsTheFolders) {
  EXPECT_THAT(Values(), IsEmpty());
  EXPECT_FALSE(fs::exists(file_)) << "nothing is written where nothing was measured";
  Add(1);
  Add(3, "petg");
  EXPECT_THAT(Values(), ElementsAre(3, 1));
  Add(2);
  EXPECT_THAT(Values(), ElementsAre(3, 2, 1));
  EXPECT_THAT(Values({.last = 1}), ElementsAre(3));
  EXPECT_THAT(Values({.subject = {.filament = "pla"}}), ElementsAre(2, 1));
  EXPECT_THAT(Values({.instrument = Instrument::kTap}), IsEmpty());
  EXPECT_EQ(Read().entries[0].folder, FolderOf(3).string());
  EXPECT_EQ(Read().entries[0].fingerprint, Fingerprint(Found(3, "petg")));
  fs::remove_all(FolderOf(3));  // its result stays in the history
  EXPECT_THAT(Values(), ElementsAre(3, 2, 1));
}

TEST_F(ResultHistory, ANewAnalysisTakesThePlaceOfTheOldOneInItsOrder) {
  Add(1);
  Add(2);
  const auto order = Read().entries[1].order;
  Keep(Found(30), 1);
  EXPECT_THAT(Values(), ElementsAre(30, 2));
  EXPECT_EQ(Read().entries[0].order, order);
}

TEST_F(ResultHistory, NamesResultsThatCannotBeRead) {
  Add(1);
  fs::create_directory(FolderOf(2));
  test::WriteWhole(FolderOf(2) / kResultFile, "{\"format\": 1");
  fs::create_directory(FolderOf(3));
  fs::create_symlink(FolderOf(1) / kResultFile, FolderOf(3) / kResultFile);
  EXPECT_THAT(Values(), ElementsAre(1));
  EXPECT_THAT(Read().skipped, ElementsAre(HasSubstr("r2")));
  EXPECT_THAT(ReadHistory(folder_.path() / "none", {}).error().message,
              HasSubstr("there is no such folder"));
}

TEST_F(ResultHistory, HostileNamesAreNamesAndNothingElse) {
  const std::vector<std::string> names = {"a'; DROP TABLE result; --", "\"quoted\"", "100 %",
                                          "\xF0\x9F\xA6\x84", "' OR '1'='1"};
  int n = 0;
  for (const std::string& name : names) Add(++n, name);
  n = 0;
  for (const std::string& name : names) {
    EXPECT_THAT(Values({.subject = {.filament = name}}), ElementsAre(++n));
  }
}

TEST_F(ResultHistory, IsBuiltAnewWhereItIsDamagedAnywhere) {
  constexpr int kResults = 20;
  for (int n = 1; n <= kResults; ++n) Add(n);
  const std::vector<double> whole = Values({.last = 100});
  ASSERT_EQ(whole.size(), std::size_t{kResults});
  {  // all of it in one file
    SQLite::Database database(file_.string(), SQLite::OPEN_READWRITE);
    database.exec("PRAGMA wal_checkpoint(TRUNCATE)");
  }
  const std::string sound = test::ReadWhole(file_);
  Random random(4711);
  for (int i = 0; i < 24; ++i) {
    std::string damaged = sound;
    const auto at = static_cast<std::size_t>(random.Uniform(0, static_cast<double>(sound.size())));
    if (i % 2 == 0) {
      damaged.resize(at);
    } else {
      damaged[at] = static_cast<char>(damaged[at] ^ 0x55);
    }
    for (const char* end : {"-wal", "-shm"}) fs::remove(file_.string() + end);
    test::WriteWhole(file_, damaged);
    ASSERT_EQ(Values({.last = 100}), whole) << (i % 2 == 0 ? "cut at " : "changed at ") << at;
  }
}

TEST_F(ResultHistory, DoesWithoutAFileThatItCannotUse) {
  Add(1);
  const auto expect_without = [&](const char* why) {
    EXPECT_THAT(Values(), ElementsAre(1));
    EXPECT_THAT(Read().without_store, HasSubstr(why));
    EXPECT_FALSE(NoteNozzleChange(folder_.path(), "2026-01-02T00:00:00Z", "printer.local"));
  };
  {
    SQLite::Database foreign(file_.string(), SQLite::OPEN_READWRITE | SQLite::OPEN_CREATE);
    foreign.exec("CREATE TABLE own (a)");
  }
  expect_without("another program's file");
  EXPECT_TRUE(SQLite::Database(file_.string()).tableExists("own"));
  fs::remove(file_);
  (void)Read();
  SQLite::Database(file_.string(), SQLite::OPEN_READWRITE).exec("PRAGMA user_version = 99");
  expect_without("another trammel wrote it");
  fs::rename(file_, folder_.path() / "other.db");
  fs::create_symlink(folder_.path() / "other.db", file_);
  expect_without("history.db");
}

TEST_F(ResultHistory, LiesInAnyLinkedFolder) {
  Add(1);
  const test::TemporaryFolder elsewhere;
  const fs::path recordings = elsewhere.path() / "recordings";
  fs::create_directory_symlink(folder_.path(), recordings);
  const auto history = ReadHistory(recordings, {});
  ASSERT_TRUE(history) << history.error().message;
  EXPECT_EQ(history->without_store, "");
  EXPECT_TRUE(fs::is_regular_file(file_));
}

TEST_F(ResultHistory, KnowsTheOrderOfResultsAndNozzleChangesWhateverTheClock) {
  Add(1);
  Add(2);
  ASSERT_TRUE(NoteNozzleChange(folder_.path(), "1970-01-01T00:00:10Z", "printer.local"));
  Add(3);
  const History history = Read();
  ASSERT_EQ(history.nozzle_changes.size(), 1U);
  const NozzleChange& change = history.nozzle_changes.front();
  EXPECT_EQ(change.printer, "printer.local");
  EXPECT_LT(change.after, history.entries[0].order);
  EXPECT_GE(change.after, history.entries[1].order);
}

TEST_F(ResultHistory, ADeletedRecordingIsGoneAndItsNumberIsNotUsedAgain) {
  Add(1);
  Add(2);
  Add(3);
  ASSERT_TRUE(WriteRemark(FolderOf(2), {"kept", true}));
  EXPECT_EQ(Read().entries.at(1).remark, (Remark{"kept", true}));
  ASSERT_TRUE(NoteNozzleChange(folder_.path(), "2026-01-05T00:00:00Z", "printer.local"));
  ASSERT_TRUE(DeleteRecording(folder_.path(), "r3"));
  EXPECT_FALSE(fs::exists(FolderOf(3)));
  EXPECT_THAT(Values(), ElementsAre(2, 1));
  Add(4);
  const History history = Read();
  EXPECT_GT(history.entries.front().order, history.nozzle_changes.front().after);
  Add(3);  // a recording of that name may come again
  EXPECT_THAT(Values(), ElementsAre(4, 3, 2, 1));

  fs::create_directory_symlink(FolderOf(1), folder_.path() / "link");
  for (const char* name : {"", ".", "..", "r1/..", "none", "link", "history.db", "/tmp"}) {
    EXPECT_FALSE(DeleteRecording(folder_.path(), name)) << name;
  }
  fs::remove(folder_.path() / "link");
  EXPECT_THAT(Values(), ElementsAre(4, 3, 2, 1));
}

TEST_F(ResultHistory, ARemarkThatCannotBeReadIsNone) {
  fs::create_directory(FolderOf(1));
  for (const char* text : {"", "[", "[]", R"({"note": 7, "pinned": "yes"})"}) {
    test::WriteWhole(FolderOf(1) / kRemarkFile, text);
    EXPECT_EQ(ReadRemark(FolderOf(1)), Remark{}) << text;
  }
  EXPECT_FALSE(WriteRemark(FolderOf(1), {std::string(kMaxNoteBytes + 1, 'x'), false}));
  EXPECT_FALSE(WriteRemark(FolderOf(1), {"\xff", false}));
  ASSERT_TRUE(WriteRemark(FolderOf(1), {}));
  EXPECT_FALSE(fs::exists(FolderOf(1) / kRemarkFile));
}

TEST_F(ResultHistory, NotesNozzleChangesADayWithinABound) {
  for (int i = 0; i < kMaxChangesADay; ++i) {
    ASSERT_TRUE(NoteNozzleChange(folder_.path(), "2026-01-02T00:00:00Z", "printer.local"));
  }
  const auto more = NoteNozzleChange(folder_.path(), "2026-01-02T23:00:00Z", "printer.local");
  ASSERT_FALSE(more);
  EXPECT_EQ(more.error().kind, ErrorKind::kMeasurement);
  EXPECT_TRUE(NoteNozzleChange(folder_.path(), "2026-01-02T23:00:00Z", "another"));
  EXPECT_TRUE(NoteNozzleChange(folder_.path(), "2026-01-03T00:00:00Z", "printer.local"));
}

}  // namespace
}  // namespace trammel::files
