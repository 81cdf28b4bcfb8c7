// history.db: what recordings beside one another gave, and when nozzles were changed, in SQLite.
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

namespace trammel::files {

/// In a folder of recordings.
inline constexpr std::string_view kHistoryFile = "history.db";

/// The result of a recording.
struct HistoryEntry {
  measurement::Outcome outcome;
  std::string folder;                     ///< of its recording
  std::string fingerprint;                ///< of the result
  std::int64_t order = 0;                 ///< in which recordings were first read, from 1
  std::vector<Application> applied = {};  ///< oldest first; AddApplications
};

struct NozzleChange {
  std::string utc;      ///< ISO 8601 to the second, ending in Z
  std::string printer;  ///< as measurement::Subject has it
  /// HistoryEntry::order of the last result before it, whatever the clock of a computer without a
  /// battery made of `utc`.
  std::int64_t after = 0;
};

/// Which results are read.
struct HistoryQuery {
  std::size_t last = 20;                                   ///< at most so many, the newest
  std::optional<measurement::Instrument> instrument = {};  ///< absent: of all
  measurement::Subject subject = {};  ///< printer, nozzle and filament where they are not empty
};

struct History {
  std::vector<HistoryEntry> entries;         ///< the newest first, by the time that they state
  std::vector<NozzleChange> nozzle_changes;  ///< of all printers, oldest first
  std::vector<std::string> skipped;          ///< what is wrong with results that cannot be read
  std::string without_store;                 ///< why history.db is not used; empty: it is
};

/// Reads the history of a folder of recordings. Results in the folders right below that are new or
/// changed are added to history.db first; those of folders that are gone stay in it. A damaged
/// history.db is kept as history.db.damaged and built anew. Where it cannot be used (another
/// program's, a newer trammel's, not writable, busy for five seconds) the folders alone are read.
/// Errors (kInput): no such folder.
[[nodiscard]] Result<History> ReadHistory(const std::filesystem::path& recordings,
                                          const HistoryQuery& query);

/// Adds to entries what applied.jsonl says of them. Errors: those of AllApplications.
[[nodiscard]] Result<void> AddApplications(const std::filesystem::path& applied, History& history);

/// The changes of a printer's nozzle that are noted in a day at most, and in all: the oldest go.
inline constexpr int kMostChangesADay = 20;
inline constexpr int kMostChanges = 1000;

/// Notes in history.db that a printer's nozzle was changed: what was measured before says nothing
/// of the new one. Errors: kInput: it cannot be written; kMeasurement: kMostChangesADay are noted.
[[nodiscard]] Result<void> NoteNozzleChange(const std::filesystem::path& recordings,
                                            const std::string& utc, const std::string& printer);

}  // namespace trammel::files
