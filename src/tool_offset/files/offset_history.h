// What became of the tools' offsets over time: a file of JSON lines that only ever grows.
#pragma once

#include <filesystem>
#include <string>
#include <string_view>
#include <vector>

#include "base/result.h"
#include "tool_offset/offset/correction.h"

namespace trammel::files {

/// In the state folder: what is applied on any printer, from whatever folder.
inline constexpr std::string_view kOffsetHistoryFile = "offset-history.jsonl";

enum class OffsetStage {
  kBegun,    ///< about to be set: the old value is safe from here on
  kApplied,  ///< set, and read back
  kKept,     ///< survives a restart, too
  kUndone,   ///< taken back: what was new is old in this line, and what was old is set again
};

/// A tool's offset was changed on a printer.
struct OffsetChange {
  OffsetStage stage = OffsetStage::kBegun;
  std::string time;     ///< ISO 8601 with its zone
  std::string printer;  ///< address
  std::string source;   ///< the file with the measured offset, from the root
  int tool = 0;
  double dx_mm = 0;  ///< that was measured, and is taken out
  double dy_mm = 0;
  tool_offset::KeptOffset old_offset;  ///< as the firmware kept it
  tool_offset::KeptOffset new_offset;
};

/// Adds a line and has the disk take it. Makes the folder. What a torn last line holds is left as
/// it is, on a line of its own. Errors (kInput) name the file and the reason.
[[nodiscard]] Result<void> AppendToHistory(const std::filesystem::path& path,
                                           const OffsetChange& change);

/// All changes in it, oldest first; none where there is no file. Other lines, and what is no line
/// of a history, are passed over: they must never keep a person from setting an offset.
/// Errors (kInput): not readable; larger than 64 MB; a format that is not known.
[[nodiscard]] Result<std::vector<OffsetChange>> ReadOffsetChanges(
    const std::filesystem::path& path);

}  // namespace trammel::files
