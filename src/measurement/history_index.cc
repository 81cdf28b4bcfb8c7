#include "measurement/history_index.h"

#include <SQLiteCpp/SQLiteCpp.h>
#include <fmt/format.h>
#include <sqlite3.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cstdint>
#include <fstream>
#include <limits>
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
    "CREATE INDEX result_by_filament ON result (filament, nozzle, utc, id);",
    // The line of history.jsonl; null: of a folder alone. What was read by another hash is read
    // anew: half lines may have been taken for whole ones.
    "ALTER TABLE result ADD COLUMN number INTEGER;"
    "ALTER TABLE source RENAME COLUMN tail_hash TO hash;"
    "UPDATE source SET hash = 0;"};

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
  // SQLite takes no link anywhere in the path. The folders are the user's, and may be linked; a
  // file of ours that is a link is nobody's (StateOf).
  std::error_code ignored;
  const fs::path folder = index.has_parent_path() ? index.parent_path() : fs::path(".");
  const fs::path real = fs::canonical(folder, ignored);
  SQLite::Database database((real.empty() ? index : real / index.filename()).string(),
                            SQLite::OPEN_READWRITE | SQLite::OPEN_CREATE | SQLite::OPEN_NOFOLLOW,
                            kWait_ms);
  database.exec(
      "PRAGMA journal_mode = WAL; PRAGMA synchronous = NORMAL; PRAGMA trusted_schema = OFF");
  Migrate(database);
  return database;
}

/// @param number  of the line in history.jsonl; absent: a folder has it, and no line
void Insert(SQLite::Database& database, const Outcome& outcome, const std::string& folder,
            const std::string& line, std::optional<std::size_t> number) {
  SQLite::Statement insert(
      database,
      "INSERT INTO result (line, line_hash, fingerprint, utc, instrument, program, folder, verdict,"
      " name, unit, value, standard_uncertainty, interval95_lo, interval95_hi, printer, nozzle,"
      " filament, number) VALUES (?,?,?,?,?,?,?,?,?,?,?,?,?,?,?,?,?,?)");
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
    for (const double of_first : {quantity.value, quantity.standard_uncertainty,
                                  quantity.interval95.lo, quantity.interval95.hi}) {
      insert.bind(++at, of_first);
    }
  } else {
    at += 4;
  }
  for (const std::string* text :
       {&outcome.subject.printer, &outcome.subject.nozzle, &outcome.subject.filament}) {
    insert.bind(++at, *text);
  }
  if (number) insert.bind(++at, static_cast<std::int64_t>(*number));
  insert.exec();
}

std::size_t Count(SQLite::Database& database, const char* table) {
  return static_cast<std::size_t>(
      database.execAndGet(fmt::format("SELECT count(*) FROM {}", table)).getInt64());
}

std::int64_t Bits(std::uint64_t hash) { return static_cast<std::int64_t>(hash); }

LinesRead ReadSoFar(SQLite::Database& database) {
  SQLite::Statement source(database, "SELECT bytes, ended, hash FROM source");
  if (!source.executeStep()) throw Damaged();
  LinesRead read;
  read.bytes = static_cast<std::size_t>(source.getColumn(0).getInt64());
  read.ended = static_cast<std::size_t>(source.getColumn(1).getInt64());
  if (read.bytes == 0) return read;  // of nothing, whichever form wrote it
  read.hash = static_cast<std::uint64_t>(source.getColumn(2).getInt64());
  return read;
}

/// A change of the index, begun when there is something to change.
class Update {
 public:
  Update(SQLite::Database& database, const LinesRead& from) : database_(&database), from_(from) {}

  void Take(const Line& line) {
    Begin();
    const std::string where = fmt::format("{}, line {}", kHistoryFile, line.number);
    const auto read = line.text
                          ? ParseHistoryLine(*line.text, where)
                          : Fail(fmt::format("{}: is longer than {} bytes", where, kMostLineBytes));
    if (read) {
      // Until now it may have been known of its folder alone.
      SQLite::Statement same(*database_,
                             "DELETE FROM result WHERE fingerprint = ? AND number IS NULL");
      same.bind(1, Fingerprint(read->first));
      same.exec();
      return Insert(*database_, read->first, read->second, std::string(*line.text), line.number);
    }
    SQLite::Statement skip(*database_, "INSERT INTO skipped VALUES (?, ?)");
    skip.bind(1, static_cast<std::int64_t>(line.number));
    skip.bind(2, line.ended ? read.error().message
                            : read.error().message + "; it is not ended yet, and is read again");
    skip.exec();
  }

  void Finish(const LinesRead& read) {
    if (read == from_ && !all_ && !HasUnended()) return;
    Begin();
    SQLite::Statement note(*database_, "UPDATE source SET bytes = ?, ended = ?, hash = ?");
    note.bind(1, static_cast<std::int64_t>(read.bytes));
    note.bind(2, static_cast<std::int64_t>(read.ended));
    note.bind(3, Bits(read.hash));
    note.exec();
    all_->commit();
  }

 private:
  void Begin() {
    if (all_) return;
    all_.emplace(*database_, SQLite::TransactionBehavior::IMMEDIATE);
    // A last line without its end is read again.
    for (const char* rows : {"result WHERE number", "skipped WHERE line"}) {
      database_->exec(fmt::format("DELETE FROM {} > {}", rows, from_.ended));
    }
  }
  [[nodiscard]] bool HasUnended() {
    return database_
               ->execAndGet(
                   fmt::format("SELECT EXISTS (SELECT 1 FROM result WHERE number > {0}) OR "
                               "EXISTS (SELECT 1 FROM skipped WHERE line > {0})",
                               from_.ended))
               .getInt() != 0;
  }

  SQLite::Database* database_;
  LinesRead from_;
  std::optional<SQLite::Transaction> all_;
};

/// Takes what history.jsonl has got since. Throws Damaged where it is not the file that was read.
Result<void> CatchUp(SQLite::Database& database, const fs::path& history) {
  std::error_code ignored;
  if (!fs::exists(history, ignored)) return {};
  const LinesRead from = ReadSoFar(database);
  Update update(database, from);
  const auto done =
      ForEachLineSince(history, from, [&update](const Line& line) { update.Take(line); });
  if (!done) return tl::unexpected(done.error());
  if (!*done) throw Damaged();
  update.Finish(**done);
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
    Insert(database, *outcome, entry.path().string(), HistoryLine(*outcome, entry.path()),
           std::nullopt);
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

/// Hands over the results but the first `given`. Throws Damaged.
void Select(SQLite::Database& database, const HistoryQuery& query, std::size_t& given,
            const TakeEntry& take) {
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
  SQLite::Statement rows(database, "SELECT line, line_hash, number FROM result WHERE " + where +
                                       " ORDER BY utc DESC, id DESC LIMIT ? OFFSET ?");
  constexpr std::size_t kAll = std::numeric_limits<std::int64_t>::max();
  int at = 0;
  for (const std::string& text : texts) rows.bind(++at, text);
  rows.bind(++at,
            static_cast<std::int64_t>(std::min(query.last - std::min(given, query.last), kAll)));
  rows.bind(++at, static_cast<std::int64_t>(given));
  while (rows.executeStep()) {
    const std::string line = rows.getColumn(0).getString();
    auto read = HashOf(line) == rows.getColumn(1).getInt64()
                    ? ParseHistoryLine(line, std::string(kIndexFile))
                    : Fail("another text than was written");
    if (!read || !Matches(query, read->first)) throw Damaged();
    const SQLite::Column number = rows.getColumn(2);
    take({std::move(read->first),
          std::move(read->second),
          {},
          number.isNull() ? std::nullopt
                          : std::optional(static_cast<std::size_t>(number.getInt64()))},
         line.size());
    ++given;
  }
}

SkippedLines Skipped(SQLite::Database& database) {
  SkippedLines skipped;
  SQLite::Statement rows(database, "SELECT reason FROM skipped ORDER BY line LIMIT ?");
  rows.bind(1, static_cast<std::int64_t>(kMostNamed));
  while (rows.executeStep()) skipped.named.push_back(rows.getColumn(0).getString());
  skipped.count = Count(database, "skipped");
  return skipped;
}

Result<FileLock> Lock(const fs::path& recordings) {
  constexpr double kPatience_s = 5;
  return FileLock::TakeWithin(recordings / fmt::format("{}.lock", kIndexFile),
                              fmt::format("trammel history, process {},", ::getpid()), kPatience_s);
}

}  // namespace

Result<SkippedLines> ForEachIndexed(const fs::path& recordings, const HistoryQuery& query,
                                    const TakeEntry& take) {
  const fs::path index = recordings / kIndexFile;
  const fs::path history = recordings / kHistoryFile;
  std::error_code ignored;
  if (!fs::exists(history, ignored) && StateOf(index) == State::kMissing) {
    return Fail(history.string() + ": there is no such file; check the path");
  }
  const auto lock = Lock(recordings);
  if (!lock) return tl::unexpected(lock.error());
  std::size_t given = 0;
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
      Select(database, query, given, take);
      return Skipped(database);
    } catch (const SQLite::Exception& thrown) {
      if (again || !IsDamage(thrown)) return tl::unexpected(ErrorOf(index, thrown));
    } catch (const Damaged&) {
      if (again) break;
    }
  }
  return Fail(index.string() + ": does not hold what was just written into it; check the disk");
}

Result<History> ReadIndexed(const fs::path& recordings, const HistoryQuery& query) {
  History history;
  std::size_t bytes = 0;
  auto skipped = ForEachIndexed(recordings, query, [&](HistoryEntry entry, std::size_t line) {
    bytes += line;
    history.cut = history.cut || bytes > kMostHistoryBytes;
    if (!history.cut) history.entries.push_back(std::move(entry));
  });
  if (!skipped) return tl::unexpected(skipped.error());
  history.skipped = std::move(skipped->named);
  history.skipped_lines = skipped->count;
  return history;
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
