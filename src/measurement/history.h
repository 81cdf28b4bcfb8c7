// history.db: results of recordings in one folder, and the dates of nozzle changes, in SQLite.
#pragma once

#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "base/result.h"
#include "measurement/applied.h"
#include "measurement/outcome.h"
#include "measurement/remark.h"

namespace trammel::files {

/// File in a folder of recordings.
inline constexpr std::string_view kHistoryFile = "history.db";

/// Result of a recording.
struct HistoryEntry {
  measurement::Outcome outcome;
  std::string folder;                     ///< recording's folder
  std::string fingerprint;                ///< result's fingerprint
  std::int64_t order = 0;                 ///< order of first reading, from 1
  std::vector<Application> applied = {};  ///< oldest first; AddApplications
  Remark remark = {};                     ///< its owner's
};

struct NozzleChange {
  std::string utc;      ///< ISO 8601 to the second, ending in Z
  std::string printer;  ///< as measurement::Subject has it
  /// HistoryEntry::order of the last result before it, independent of `utc`, which may be wrong on
  /// a computer without a clock battery.
  std::int64_t after = 0;
};

/// Filter of the results.
struct HistoryQuery {
  std::size_t last = 20;                                   ///< maximum number of newest entries
  std::optional<measurement::Instrument> instrument = {};  ///< absent: of all
  measurement::Subject subject = {};  ///< printer, nozzle and filament where they are not empty
};

struct History {
  std::vector<HistoryEntry> entries;         ///< the newest first, by the time that they state
  std::vector<NozzleChange> nozzle_changes;  ///< of all printers, oldest first
  std::vector<std::string> skipped;          ///< errors of unreadable results
  std::string without_store;                 ///< why history.db is not used; empty: it is used
};

/// Reads the history of a folder of recordings. First adds new or changed results in its direct
/// subfolders to history.db; results of deleted folders remain there. A damaged history.db is
/// renamed history.db.damaged and rebuilt. If it is unusable (another program's, a newer trammel's,
/// not writable, busy for five seconds), only the folders are read.
/// Errors (kInput): no such folder.
[[nodiscard]] Result<History> ReadHistory(const std::filesystem::path& recordings,
                                          const HistoryQuery& query);

/// Removes a recording: its folder with all files, and its result. Follows no link.
/// Errors (kInput): no such folder directly in the recordings; it cannot be removed.
[[nodiscard]] Result<void> DeleteRecording(const std::filesystem::path& recordings,
                                           const std::string& folder);

/// Adds to entries their records in applied.jsonl. Errors: those of AllApplications.
[[nodiscard]] Result<void> AddApplications(const std::filesystem::path& applied, History& history);

/// Maximum number of nozzle changes recorded a printer, per day and in total: the oldest are
/// dropped.
inline constexpr int kMaxChangesADay = 20;
inline constexpr int kMaxChanges = 1000;

/// Records in history.db that a printer's nozzle was changed: earlier measurements do not apply to
/// the new one. Errors: kInput: it cannot be written; kMeasurement: kMaxChangesADay are recorded.
[[nodiscard]] Result<void> NoteNozzleChange(const std::filesystem::path& recordings,
                                            const std::string& utc, const std::string& printer);

}  // namespace trammel::files
