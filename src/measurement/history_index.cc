#include "measurement/history_index.h"

#include <SQLiteCpp/SQLiteCpp.h>
#include <fmt/format.h>
#include <sqlite3.h>

#include <algorithm>
#include <array>
#include <cstdint>
#include <fstream>
#include <optional>
#include <utility>
#include <vector>

#include "files/file_lock.h"
#include "files/whole_file.h"
#include "measurement/json_lines.h"
#include "measurement/outcome_file.h"

namespace trammel::files {
namespace {

namespace fs = std::filesystem;
using measurement::Answer;
using measurement::Outcome;

constexpr std::uint32_t kApplicationId = 0x54524D4C;  // "TRML"
constexpr std::size_t kMostNamed = 10;

// Each takes an index from the version that is its place to the next.
constexpr std::array<const char*, kIndexVersion> kMigrations = {
    "CREATE TABLE result (id INTEGER PRIMARY KEY, line TEXT NOT NULL, line_hash INTEGER NOT NULL,"
    " fingerprint TEXT NOT NULL, utc TEXT NOT NULL, instrument TEXT NOT NULL, program TEXT NOT "
    "NULL,"
    " folder TEXT NOT NULL, verdict TEXT NOT NULL, name TEXT NOT NULL, unit TEXT NOT NULL,"
    " value REAL, standard_uncertainty REAL, interval95_lo REAL, interval95_hi REAL) STRICT;"
    "CREATE INDEX result_by_time ON result (utc, id);"
    "CREATE INDEX result_by_fingerprint ON result (fingerprint);"
    "CREATE TABLE skipped (line INTEGER NOT NULL, reason TEXT NOT NULL) STRICT;"
    "CREATE TABLE source (bytes INTEGER NOT NULL, ended INTEGER NOT NULL,"
    " tail_hash INTEGER NOT NULL) STRICT;"
    "INSERT INTO source VALUES (0, 0, 0);",
    "ALTER TABLE result ADD COLUMN printer TEXT NOT NULL DEFAULT '';"
    "ALTER TABLE result ADD COLUMN nozzle TEXT NOT NULL DEFAULT '';"
    "ALTER TABLE result ADD COLUMN filament TEXT NOT NULL DEFAULT '';"
    "CREATE INDEX result_by_filament ON result (filament, nozzle, utc, id);"};

/// An index that does not say what was written into it.
struct Damaged {};

std::int64_t HashOf(std::string_view text) { return static_cast<std::int64_t>(Fnv1a(text)); }

Error ErrorOf(const fs::path& index, const SQLite::Exception& thrown) {
  if (thrown.getErrorCode() == SQLITE_FULL) {
    return {ErrorKind::kInput, index.string() + ": cannot be written: no space left on the disk"};
  }
  return {ErrorKind::kInput, fmt::format("{}: {}; look whether its folder may be written",
                                         index.string(), thrown.what())};
}

bool IsDamage(const SQLite::Exception& thrown) {
  return thrown.getErrorCode() == SQLITE_CORRUPT || thrown.getErrorCode() == SQLITE_NOTADB ||
         thrown.getErrorCode() == SQLITE_ERROR;  // a table that is not there
}

enum class State { kMissing, kSound, kDamaged, kNewer, kForeign };

std::uint32_t BigEndian(std::string_view bytes, std::size_t at, std::size_t count) {
  std::uint32_t value = 0;
  for (const unsigned char c : bytes.substr(at, count)) value = value << 8 | c;
  return value;
}

/// Looks at the first bytes of a database (sqlite.org/fileformat.html, 1.3): nothing is opened that
/// is not ours, and SQLite itself does not notice every missing end.
State StateOf(const fs::path& index) {
  constexpr std::string_view kMagic("SQLite format 3\0", 16);
  constexpr std::size_t kHeader = 100;
  std::error_code ignored;
  if (!fs::exists(fs::symlink_status(index, ignored))) return State::kMissing;
  if (!fs::is_regular_file(fs::symlink_status(index, ignored))) return State::kForeign;
  std::ifstream file(index, std::ios::binary);
  std::string head(kHeader, '\0');
  file.read(head.data(), kHeader);
  if (file.gcount() != kHeader || !head.starts_with(kMagic)) return State::kDamaged;
  if (BigEndian(head, 68, 4) != kApplicationId) return State::kForeign;
  if (BigEndian(head, 60, 4) > static_cast<std::uint32_t>(kIndexVersion)) return State::kNewer;
  const std::uint64_t page = BigEndian(head, 16, 2) == 1 ? 65536 : BigEndian(head, 16, 2);
  const fs::path log = index.string() + "-wal";
  const bool logged = fs::exists(log, ignored) && fs::file_size(log, ignored) > 0;
  const bool whole = fs::file_size(index, ignored) == page * BigEndian(head, 28, 4);
  return whole || logged ? State::kSound : State::kDamaged;
}

Error Untouchable(const fs::path& index, State state) {
  return {
      ErrorKind::kInput,
      state == State::kNewer
          ? fmt::format("{}: a newer trammel wrote it, in a form behind {}, the newest that this "
                        "one knows; update trammel, or build one for this one with trammel "
                        "history rebuild --out FILE",
                        index.string(), kIndexVersion)
          : fmt::format("{}: another program's file has this name; it stays as it is: rename it",
                        index.string())};
}

void Migrate(SQLite::Database& database) {
  SQLite::Transaction all(database, SQLite::TransactionBehavior::IMMEDIATE);
  const int version = database.execAndGet("PRAGMA user_version").getInt();
  for (int next = version; next < kIndexVersion; ++next) {
    database.exec(kMigrations.at(static_cast<std::size_t>(next)));
  }
  if (version < kIndexVersion) {
    database.exec(fmt::format("PRAGMA application_id = {}", kApplicationId));
    database.exec(fmt::format("PRAGMA user_version = {}", kIndexVersion));
  }
  all.commit();
}

SQLite::Database Open(const fs::path& index) {
  constexpr int kWait_ms = 5000;
  SQLite::Database database(index.string(),
                            SQLite::OPEN_READWRITE | SQLite::OPEN_CREATE | SQLite::OPEN_NOFOLLOW,
                            kWait_ms);
  database.exec(
      "PRAGMA journal_mode = WAL; PRAGMA synchronous = NORMAL; PRAGMA trusted_schema = OFF");
  Migrate(database);
  return database;
}

void Insert(SQLite::Database& database, const Outcome& outcome, const std::string& folder,
            const std::string& line) {
  SQLite::Statement insert(
      database,
      "INSERT INTO result (line, line_hash, fingerprint, utc, instrument, program, folder, verdict,"
      " name, unit, value, standard_uncertainty, interval95_lo, interval95_hi, printer, nozzle,"
      " filament) VALUES (?,?,?,?,?,?,?,?,?,?,?,?,?,?,?,?,?)");
  const auto& provenance = outcome.provenance;
  const Answer none;
  const Answer& first = outcome.answers.empty() ? none : outcome.answers.front();
  int at = 0;
  insert.bind(++at, line);
  insert.bind(++at, HashOf(line));
  for (const std::string& text :
       {Fingerprint(outcome), provenance.utc, std::string(ToString(provenance.instrument)),
        provenance.program, folder, std::string(ToString(outcome.verdict())), first.name,
        first.unit}) {
    insert.bind(++at, text);
  }
  if (first.value.good()) {
    const Quantity& quantity = first.value.quantity();
    for (const double number : {quantity.value, quantity.standard_uncertainty,
                                quantity.interval95.lo, quantity.interval95.hi}) {
      insert.bind(++at, number);
    }
  } else {
    at += 4;
  }
  for (const std::string* text :
       {&outcome.subject.printer, &outcome.subject.nozzle, &outcome.subject.filament}) {
    insert.bind(++at, *text);
  }
  insert.exec();
}

/// Tells whether the file still begins as it did: the hash of what lies before a place in it.
std::int64_t TailHash(const fs::path& path, std::size_t end) {
  constexpr std::size_t kTail = 4096;
  std::string tail(std::min(kTail, end), '\0');
  std::ifstream file(path, std::ios::binary);
  file.seekg(static_cast<std::streamoff>(end - tail.size()));
  file.read(tail.data(), static_cast<std::streamsize>(tail.size()));
  return file ? HashOf(tail) : 0;
}

std::size_t Count(SQLite::Database& database, const char* table) {
  return static_cast<std::size_t>(
      database.execAndGet(fmt::format("SELECT count(*) FROM {}", table)).getInt64());
}

/// Takes what history.jsonl has got since. Throws Damaged where it is not the file that was read.
Result<void> CatchUp(SQLite::Database& database, const fs::path& history) {
  std::error_code ignored;
  if (!fs::exists(history, ignored)) return {};
  LinesRead from;
  {
    SQLite::Statement source(database, "SELECT bytes, ended, tail_hash FROM source");
    if (!source.executeStep()) throw Damaged();
    from.bytes = static_cast<std::size_t>(source.getColumn(0).getInt64());
    from.ended = static_cast<std::size_t>(source.getColumn(1).getInt64());
    const std::uintmax_t size = fs::file_size(history, ignored);
    if (size < from.bytes) throw Damaged();
    if (from.bytes > 0 && TailHash(history, from.bytes) != source.getColumn(2).getInt64()) {
      throw Damaged();
    }
    if (size == from.bytes) return {};
    // Results of folders alone may be those of a history that is there again.
    if (from.bytes == 0 && Count(database, "result") > 0) throw Damaged();
  }
  SQLite::Transaction all(database, SQLite::TransactionBehavior::IMMEDIATE);
  const auto take = [&](std::optional<std::string_view> line, std::size_t number) {
    const std::string where = fmt::format("{}, line {}", kHistoryFile, number);
    const auto read = line
                          ? ParseHistoryLine(*line, where)
                          : Fail(fmt::format("{}: is longer than {} bytes", where, kMostLineBytes));
    if (read) return Insert(database, read->first, read->second, std::string(*line));
    SQLite::Statement skip(database, "INSERT INTO skipped VALUES (?, ?)");
    skip.bind(1, static_cast<std::int64_t>(number));
    skip.bind(2, read.error().message);
    skip.exec();
  };
  const auto done = ForEachLine(history, from, take);
  if (!done) return tl::unexpected(done.error());
  SQLite::Statement note(database, "UPDATE source SET bytes = ?, ended = ?, tail_hash = ?");
  note.bind(1, static_cast<std::int64_t>(done->bytes));
  note.bind(2, static_cast<std::int64_t>(done->ended));
  note.bind(3, TailHash(history, done->bytes));
  note.exec();
  all.commit();
  return {};
}

/// Adds the results in folders that history.jsonl does not have. @returns how many.
std::size_t AddFolders(SQLite::Database& database, const fs::path& recordings) {
  SQLite::Transaction all(database, SQLite::TransactionBehavior::IMMEDIATE);
  std::size_t added = 0;
  std::error_code ignored;
  for (const auto& entry : fs::directory_iterator(recordings, ignored)) {
    const fs::path file = entry.path() / kResultFile;
    if (!entry.is_directory(ignored) || !fs::is_regular_file(file, ignored)) continue;
    const auto text = ReadNamedFile(file, kMaxResultBytes);
    const auto outcome =
        text ? ParseOutcome(*text, file.string()) : Result<Outcome>(tl::unexpected(text.error()));
    if (!outcome) continue;
    SQLite::Statement known(database, "SELECT 1 FROM result WHERE fingerprint = ?");
    known.bind(1, Fingerprint(*outcome));
    if (known.executeStep()) continue;
    Insert(database, *outcome, entry.path().string(), HistoryLine(*outcome, entry.path()));
    ++added;
  }
  all.commit();
  return added;
}

void RemoveLogs(const fs::path& index) {
  std::error_code ignored;
  for (const char* end : {"-wal", "-shm", "-journal"}) fs::remove(index.string() + end, ignored);
}

/// Builds under another name, and takes the name at the end: a killed rebuild leaves the old one.
Result<RebuiltIndex> Build(const fs::path& recordings, const fs::path& index) {
  const fs::path meanwhile = index.string() + ".new";
  std::error_code code;
  fs::remove(meanwhile, code);
  RemoveLogs(meanwhile);
  RebuiltIndex rebuilt;
  try {
    SQLite::Database database = Open(meanwhile);
    if (auto read = CatchUp(database, recordings / kHistoryFile); !read) {
      return tl::unexpected(read.error());
    }
    rebuilt.from_folders = AddFolders(database, recordings);
    rebuilt.results = Count(database, "result");
  } catch (const SQLite::Exception& thrown) {
    const Error error = ErrorOf(index, thrown);
    fs::remove(meanwhile, code);
    RemoveLogs(meanwhile);
    return tl::unexpected(error);
  }
  if (StateOf(index) == State::kDamaged) fs::rename(index, index.string() + ".damaged", code);
  RemoveLogs(index);
  fs::rename(meanwhile, index, code);
  if (code) return Fail(index.string() + ": cannot be written: " + code.message());
  return rebuilt;
}

Result<History> Select(SQLite::Database& database, const HistoryQuery& query) {
  std::string where = "1";
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
  SQLite::Statement rows(database, "SELECT line, line_hash FROM result WHERE " + where +
                                       " ORDER BY utc DESC, id DESC LIMIT ?");
  int at = 0;
  for (const std::string& text : texts) rows.bind(++at, text);
  rows.bind(++at, static_cast<std::int64_t>(query.last));
  History history;
  while (rows.executeStep()) {
    const std::string line = rows.getColumn(0).getString();
    auto read = HashOf(line) == rows.getColumn(1).getInt64()
                    ? ParseHistoryLine(line, std::string(kIndexFile))
                    : Fail("another text than was written");
    if (!read || !Matches(query, read->first)) throw Damaged();
    history.entries.push_back({std::move(read->first), std::move(read->second)});
  }
  SQLite::Statement skipped(database, "SELECT reason FROM skipped ORDER BY line LIMIT ?");
  skipped.bind(1, static_cast<std::int64_t>(kMostNamed));
  while (skipped.executeStep()) history.skipped.push_back(skipped.getColumn(0).getString());
  history.skipped_lines = Count(database, "skipped");
  return history;
}

Result<FileLock> Lock(const fs::path& recordings) {
  return FileLock::Take(recordings / fmt::format("{}.lock", kIndexFile), "trammel history");
}

}  // namespace

Result<History> ReadIndexed(const fs::path& recordings, const HistoryQuery& query) {
  const fs::path index = recordings / kIndexFile;
  const fs::path history = recordings / kHistoryFile;
  std::error_code ignored;
  if (!fs::exists(history, ignored) && StateOf(index) == State::kMissing) {
    return Fail(history.string() + ": there is no such file; check the path");
  }
  const auto lock = Lock(recordings);
  if (!lock) return tl::unexpected(lock.error());
  for (const bool again : {false, true}) {
    const State state = StateOf(index);
    if (state == State::kNewer || state == State::kForeign) {
      return tl::unexpected(Untouchable(index, state));
    }
    if (again || state != State::kSound) {
      if (auto built = Build(recordings, index); !built) return tl::unexpected(built.error());
    }
    try {
      SQLite::Database database = Open(index);
      if (auto read = CatchUp(database, history); !read) return tl::unexpected(read.error());
      return Select(database, query);
    } catch (const SQLite::Exception& thrown) {
      if (again || !IsDamage(thrown)) return tl::unexpected(ErrorOf(index, thrown));
    } catch (const Damaged&) {
      if (again) break;
    }
  }
  return Fail(index.string() + ": does not hold what was just written into it; check the disk");
}

Result<RebuiltIndex> RebuildIndex(const fs::path& recordings, const fs::path& index) {
  const fs::path target = index.empty() ? recordings / kIndexFile : index;
  std::error_code ignored;
  if (!fs::is_directory(recordings, ignored)) {
    return Fail(recordings.string() + ": there is no such folder; check the path");
  }
  const State state = StateOf(target);
  if (state == State::kNewer || state == State::kForeign) {
    return tl::unexpected(Untouchable(target, state));
  }
  if (!index.empty() && state != State::kMissing) {
    return Fail(index.string() + ": is there already; name another file");
  }
  const auto lock = Lock(recordings);
  if (!lock) return tl::unexpected(lock.error());
  return Build(recordings, target);
}

}  // namespace trammel::files
