#include "measurement/history.h"

#include <SQLiteCpp/SQLiteCpp.h>
#include <fmt/format.h>
#include <sqlite3.h>
#include <unistd.h>

#include <algorithm>
#include <functional>
#include <limits>
#include <map>
#include <system_error>
#include <utility>

#include "files/new_file.h"
#include "measurement/outcome_file.h"

namespace trammel::files {
namespace {

namespace fs = std::filesystem;
using measurement::Outcome;

constexpr int kApplicationId = 0x54524D4C;  // "TRML"
constexpr int kVersion = 1;
const std::string kDeleted = ".deleted-";  // begins the name of a folder that is being removed

constexpr const char* kTables =
    "CREATE TABLE result (id INTEGER PRIMARY KEY, folder TEXT NOT NULL UNIQUE,"
    " stamp TEXT NOT NULL, fingerprint TEXT NOT NULL, utc TEXT NOT NULL, instrument TEXT NOT NULL,"
    " printer TEXT NOT NULL, nozzle TEXT NOT NULL, filament TEXT NOT NULL, json TEXT NOT NULL)"
    " STRICT;"
    "CREATE INDEX result_by_time ON result (utc, id);"
    "CREATE INDEX result_by_filament ON result (filament, nozzle, utc, id);"
    "CREATE TABLE nozzle_change (utc TEXT NOT NULL, printer TEXT NOT NULL,"
    " after_id INTEGER NOT NULL) STRICT;";

/// Database that lacks data written into it.
struct Damaged {};
/// Database that must not be changed, and why.
struct Foreign {
  std::string why;
};

int Number(SQLite::Database& database, const std::string& query) {
  return database.execAndGet(query).getInt();
}

void CreateTables(SQLite::Database& database) {
  SQLite::Transaction all(database, SQLite::TransactionBehavior::IMMEDIATE);
  database.exec(kTables);
  database.exec(fmt::format("PRAGMA application_id = {}; PRAGMA user_version = {}", kApplicationId,
                            kVersion));
  all.commit();
}

/// Throws Damaged, Foreign, SQLite::Exception.
SQLite::Database OpenFile(const fs::path& recordings) {
  // SQLite accepts no link anywhere in the path. The folders are the user's, and may be links; our
  // own file must not be one.
  const fs::path file = fs::canonical(recordings) / kHistoryFile;
  SQLite::Database database(file.string(),
                            SQLite::OPEN_READWRITE | SQLite::OPEN_CREATE | SQLite::OPEN_NOFOLLOW);
  database.exec("PRAGMA synchronous = NORMAL; PRAGMA trusted_schema = OFF");
  const int application = Number(database, "PRAGMA application_id");
  if (application == 0 && Number(database, "SELECT count(*) FROM sqlite_schema") == 0) {
    database.exec("PRAGMA journal_mode = WAL");
    CreateTables(database);
  } else if (application != kApplicationId) {
    throw Foreign{"another program's file has this name; rename it"};
  } else if (Number(database, "PRAGMA user_version") != kVersion) {
    throw Foreign{"another trammel wrote it, in another form; use that one, or rename the file"};
  }
  if (database.execAndGet("PRAGMA quick_check(1)").getString() != "ok") throw Damaged();
  return database;
}

bool IsDamage(const SQLite::Exception& thrown) {
  return thrown.getErrorCode() == SQLITE_CORRUPT || thrown.getErrorCode() == SQLITE_NOTADB ||
         thrown.getErrorCode() == SQLITE_ERROR;  // a table that is not there
}

void SetAside(const fs::path& file) {
  std::error_code ignored;
  fs::rename(file, file.string() + ".damaged", ignored);
  for (const char* end : {"-wal", "-shm", "-journal"}) fs::remove(file.string() + end, ignored);
}

/// Result in a folder on the disk.
struct Found {
  std::string folder;  ///< folder name
  std::string stamp;   ///< another one is another file
  Outcome outcome = {};
};

/// Calls `visit` for each direct subfolder with a result, until it returns false.
void ForEachResultFile(const fs::path& recordings,
                       const std::function<bool(const fs::path& file)>& visit) {
  std::error_code error;
  for (fs::directory_iterator folder(recordings, error), end; !error && folder != end;
       folder.increment(error)) {
    std::error_code gone;
    if (folder->path().filename().string().starts_with(kDeleted)) continue;
    const fs::path file = folder->path() / kResultFile;
    if (fs::is_regular_file(fs::symlink_status(file, gone)) && !visit(file)) return;
  }
}

bool HasResults(const fs::path& recordings) {
  bool has = false;
  ForEachResultFile(recordings, [&has](const fs::path&) {
    has = true;
    return false;
  });
  return has;
}

/// Returns the results missing in the database, the oldest first.
std::vector<Found> FindNew(SQLite::Database& database, const fs::path& recordings,
                           std::vector<std::string>& skipped) {
  std::map<std::string, std::string> known;
  SQLite::Statement rows(database, "SELECT folder, stamp FROM result");
  while (rows.executeStep()) known[rows.getColumn(0).getString()] = rows.getColumn(1).getString();
  std::vector<Found> found;
  ForEachResultFile(recordings, [&](const fs::path& file) {
    std::error_code gone;
    const auto written = fs::last_write_time(file, gone).time_since_epoch().count();
    Found one{file.parent_path().filename().string(),
              fmt::format("{}-{}", written, fs::file_size(file, gone))};
    const auto before = known.find(one.folder);
    if (gone || (before != known.end() && before->second == one.stamp)) return true;
    auto outcome = ReadOutcome(file);
    if (outcome) {
      one.outcome = std::move(*outcome);
      found.push_back(std::move(one));
    } else {
      skipped.push_back(outcome.error().message);
    }
    return true;
  });
  std::ranges::sort(found, {}, [](const Found& one) {
    return std::pair(one.outcome.provenance.utc, one.folder);
  });
  return found;
}

/// Reads the folders; a new analysis of a recording replaces the earlier one.
void ReadFolders(SQLite::Database& database, const fs::path& recordings,
                 std::vector<std::string>& skipped) {
  const std::vector<Found> found = FindNew(database, recordings, skipped);
  if (found.empty()) return;
  SQLite::Transaction all(database, SQLite::TransactionBehavior::IMMEDIATE);
  SQLite::Statement insert(
      database,
      "INSERT INTO result (folder, stamp, fingerprint, utc, instrument, printer, nozzle, filament,"
      " json) VALUES (?,?,?,?,?,?,?,?,?) ON CONFLICT (folder) DO UPDATE SET stamp = excluded.stamp,"
      " fingerprint = excluded.fingerprint, utc = excluded.utc, instrument = excluded.instrument,"
      " printer = excluded.printer, nozzle = excluded.nozzle, filament = excluded.filament,"
      " json = excluded.json");
  for (const auto& [folder, stamp, outcome] : found) {
    const measurement::Subject& subject = outcome.subject;
    int at = 0;
    for (const std::string& text :
         {folder, stamp, Fingerprint(outcome), outcome.provenance.utc,
          std::string(ToString(outcome.provenance.instrument)), subject.printer, subject.nozzle,
          subject.filament, ToJson(outcome)}) {
      insert.bind(++at, text);
    }
    insert.exec();
    insert.reset();
  }
  all.commit();
}

/// Throws Damaged.
std::vector<HistoryEntry> Select(SQLite::Database& database, const fs::path& recordings,
                                 const HistoryQuery& query) {
  std::string where = "json <> ''";  // one without is of a deleted recording
  std::vector<std::string> texts;
  const auto ask = [&](const char* column, const std::string& text) {
    if (text.empty()) return;
    where += fmt::format(" AND {} = ?", column);
    texts.push_back(text);
  };
  if (query.instrument) ask("instrument", std::string(ToString(*query.instrument)));
  ask("printer", query.subject.printer);
  ask("nozzle", query.subject.nozzle);
  ask("filament", query.subject.filament);
  SQLite::Statement rows(database, "SELECT id, folder, fingerprint, json FROM result WHERE " +
                                       where + " ORDER BY utc DESC, id DESC LIMIT ?");
  int at = 0;
  for (const std::string& text : texts) rows.bind(++at, text);
  constexpr std::size_t kAll = std::numeric_limits<std::int64_t>::max();
  rows.bind(++at, static_cast<std::int64_t>(std::min(query.last, kAll)));
  std::vector<HistoryEntry> entries;
  while (rows.executeStep()) {
    HistoryEntry entry;
    entry.order = rows.getColumn(0).getInt64();
    entry.folder = (recordings / rows.getColumn(1).getString()).string();
    entry.fingerprint = rows.getColumn(2).getString();
    auto outcome = ParseOutcome(rows.getColumn(3).getString(), std::string(kHistoryFile));
    if (!outcome || Fingerprint(*outcome) != entry.fingerprint) throw Damaged();
    entry.outcome = std::move(*outcome);
    entry.remark = ReadRemark(entry.folder);
    entries.push_back(std::move(entry));
  }
  return entries;
}

std::vector<NozzleChange> NozzleChanges(SQLite::Database& database) {
  std::vector<NozzleChange> changes;
  SQLite::Statement rows(database,
                         "SELECT utc, printer, after_id FROM nozzle_change ORDER BY rowid");
  while (rows.executeStep()) {
    changes.push_back({rows.getColumn(0).getString(), rows.getColumn(1).getString(),
                       rows.getColumn(2).getInt64()});
  }
  return changes;
}

/// Uses history.db, created or rebuilt if necessary; `use` may throw as OpenFile does, and is
/// called again then. @returns why it cannot be used; empty: success.
std::string UseFile(const fs::path& recordings, const std::function<void(SQLite::Database&)>& use) {
  constexpr double kPatience_s = 5;
  const fs::path file = recordings / kHistoryFile;
  const auto lock =
      FileLock::TakeWithin(recordings / fmt::format("{}.lock", kHistoryFile),
                           fmt::format("trammel history, process {},", ::getpid()), kPatience_s);
  if (!lock) return lock.error().message;
  for (int attempt = 0; attempt < 2; ++attempt) {
    try {
      SQLite::Database database = OpenFile(recordings);
      use(database);
      return {};
    } catch (const Damaged&) {
    } catch (const Foreign& foreign) {
      return fmt::format("{}: {}", file.string(), foreign.why);
    } catch (const SQLite::Exception& thrown) {
      if (thrown.getErrorCode() == SQLITE_FULL) return file.string() + ": no space on the disk";
      if (!IsDamage(thrown)) return fmt::format("{}: {}", file.string(), thrown.what());
    }
    SetAside(file);
  }
  return file.string() + ": does not hold what was just written into it; check the disk";
}

}  // namespace

Result<History> ReadHistory(const fs::path& recordings, const HistoryQuery& query) {
  std::error_code ignored;
  if (!fs::is_directory(recordings, ignored)) {
    return Fail(recordings.string() + ": there is no such folder; check the path");
  }
  History history;
  const auto read = [&](SQLite::Database& database) {
    history = {};
    ReadFolders(database, recordings, history.skipped);
    history.entries = Select(database, recordings, query);
    history.nozzle_changes = NozzleChanges(database);
  };
  if (!fs::exists(recordings / kHistoryFile, ignored) && !HasResults(recordings)) return history;
  const std::string why_not = UseFile(recordings, read);
  if (why_not.empty()) return history;
  SQLite::Database in_memory(":memory:", SQLite::OPEN_READWRITE | SQLite::OPEN_CREATE);
  CreateTables(in_memory);
  read(in_memory);
  history.without_store = why_not;
  return history;
}

// The row stays, without its contents: the next one must not get its number, which nozzle changes
// refer to.
Result<void> DeleteRecording(const fs::path& recordings, const std::string& folder) {
  const fs::path path = recordings / folder;
  const bool plain = !folder.empty() && folder.find('/') == std::string::npos && folder[0] != '.';
  std::error_code error;
  if (!plain || !fs::is_directory(fs::symlink_status(path, error))) {
    return Fail(fmt::format("there is no recording '{}'", folder));
  }
  const fs::path gone = recordings / (kDeleted + folder);
  std::error_code kept;
  const std::string why_not = UseFile(recordings, [&](SQLite::Database& database) {
    if (fs::exists(path, error)) fs::rename(path, gone, kept);
    if (kept) return;
    SQLite::Statement empty(
        database,
        "UPDATE result SET folder = '/' || id, stamp = '', fingerprint = '',"
        " printer = '', nozzle = '', filament = '', json = '' WHERE folder = ?");
    empty.bind(1, folder);
    empty.exec();
  });
  if (!why_not.empty()) return Fail(why_not);
  if (kept) return Fail(fmt::format("cannot remove {}: {}", path.string(), kept.message()));
  // Without the lock: it may be gigabytes. What an earlier run left is removed, too.
  std::vector<fs::path> left;
  for (fs::directory_iterator each(recordings, error), end; !error && each != end;
       each.increment(error)) {
    if (each->path().filename().string().starts_with(kDeleted)) left.push_back(each->path());
  }
  for (const fs::path& each : left) fs::remove_all(each, error);
  return {};
}

Result<void> AddApplications(const fs::path& applied, History& history) {
  const auto all = TRY(AllApplications(applied));
  for (HistoryEntry& entry : history.entries) {
    const auto found = all.find(entry.fingerprint);
    if (found != all.end()) entry.applied = found->second;
  }
  return {};
}

Result<void> NoteNozzleChange(const fs::path& recordings, const std::string& utc,
                              const std::string& printer) {
  constexpr std::size_t kDay = std::string_view("2026-01-02").size();
  int today = 0;
  const std::string why_not = UseFile(recordings, [&](SQLite::Database& database) {
    std::vector<std::string> skipped;
    ReadFolders(database, recordings, skipped);
    SQLite::Statement count(
        database, "SELECT count(*) FROM nozzle_change WHERE printer = ? AND utc LIKE ? || '%'");
    count.bind(1, printer);
    count.bind(2, utc.substr(0, kDay));
    count.executeStep();
    today = count.getColumn(0).getInt();
    if (today >= kMaxChangesADay) return;
    SQLite::Statement note(database,
                           "INSERT INTO nozzle_change (utc, printer, after_id) SELECT ?, ?,"
                           " coalesce(max(id), 0) FROM result");
    note.bind(1, utc);
    note.bind(2, printer);
    note.exec();
    database.exec(
        fmt::format("DELETE FROM nozzle_change WHERE rowid <= (SELECT max(rowid) FROM "
                    "nozzle_change) - {}",
                    kMaxChanges));
  });
  if (!why_not.empty()) return Fail(why_not);
  if (today < kMaxChangesADay) return {};
  return Fail(fmt::format("{} changes of this printer's nozzle are noted of today already; does a "
                          "macro or a program note them again and again?",
                          today),
              ErrorKind::kMeasurement);
}

}  // namespace trammel::files
