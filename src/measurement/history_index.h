// history.db: an index over history.jsonl and the results in recordings' folders, in SQLite. These
// are the truth; the index is made anew from them whenever it is missing or damaged.
#pragma once

#include <cstddef>
#include <filesystem>
#include <functional>
#include <string>
#include <string_view>
#include <vector>

#include "base/result.h"
#include "measurement/history.h"

namespace trammel::files {

/// Beside history.jsonl.
inline constexpr std::string_view kIndexFile = "history.db";

/// The newest form of the index; SQLite's user_version.
inline constexpr int kIndexVersion = 3;

/// Takes a result, and how long its line is.
using TakeEntry = std::function<void(HistoryEntry entry, std::size_t bytes)>;

/// Lines of history.jsonl that are no result.
struct SkippedLines {
  std::vector<std::string> named;  ///< what is wrong with them, at most 10
  std::size_t count = 0;
};

/// Hands over results through the index of a folder of recordings, the newest by their time first.
/// The index is made, migrated from an older form, brought up to history.jsonl's last line, or
/// rebuilt where it is damaged or history.jsonl was changed anywhere before its end. A damaged one
/// is kept as history.db.damaged. A last line that nobody has ended yet counts as it stands, and is
/// read again the next time. Waits some seconds for another process that is at the index.
/// Memory: a result at a time.
/// Errors: kInput where there is neither history.jsonl nor an index, where a newer trammel wrote
/// the index or it is another program's (it stays as it is), not writable, no space; kMachine
/// where another process stays at it. ReadHistory does without the index.
[[nodiscard]] Result<SkippedLines> ForEachIndexed(const std::filesystem::path& recordings,
                                                  const HistoryQuery& query, const TakeEntry& take);

/// The same as a History. Memory: kMostHistoryBytes of results.
[[nodiscard]] Result<History> ReadIndexed(const std::filesystem::path& recordings,
                                          const HistoryQuery& query);

struct RebuiltIndex {
  std::size_t results = 0;
  std::size_t from_folders = 0;  ///< of these: those that history.jsonl does not have
};

/// Builds the index anew from history.jsonl and the result.json of each folder.
/// @param index  the file; empty: the folder's own, which is replaced unless a newer trammel or
///     another program wrote it. Any other must not be there yet.
/// Errors: as above.
[[nodiscard]] Result<RebuiltIndex> RebuildIndex(const std::filesystem::path& recordings,
                                                const std::filesystem::path& index = {});

}  // namespace trammel::files
