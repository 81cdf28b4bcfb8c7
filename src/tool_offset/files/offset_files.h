// Files of tool offsets: an open measurement, its steps, and the history of what was set.
#pragma once

#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "base/measured.h"
#include "base/result.h"
#include "measurement/outcome.h"
#include "tool_offset/offset/correction.h"

namespace trammel::files {

struct MeasuredOffset {
  int tool = 0;
  double dx_mm = 0;  ///< where its line lands minus where the reference tool's would
  double dy_mm = 0;
  Interval dx95_mm = {};
  Interval dy95_mm = {};
};

struct OffsetFile {
  std::vector<MeasuredOffset> good;  ///< tools whose verdict is good
  std::vector<std::string> refused;  ///< a line for each of the others, with its reason
  measurement::Outcome result = {};
};

/// A folder's result.json, or a kept result. Errors (kInput): not there, another instrument's, an
/// offset beyond 50 mm.
[[nodiscard]] Result<OffsetFile> ReadOffsetFile(const std::filesystem::path& path);

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

inline constexpr std::string_view kStartFile = "start.json";

/// How far it came; each is on the disk before what follows it begins.
enum class StartStage {
  kPrinting,  ///< the sheet is about to be printed
  kPrinted,   ///< it lies on the bed
  kAnalysed,  ///< result.json is there
};

/// A tool of the sheet, as the printer kept its offset while it was printed.
struct StartedTool {
  int tool = 0;
  std::optional<tool_offset::KeptOffset> kept = {};  ///< absent: the printer does not tell
};

struct StartRecord {
  StartStage stage = StartStage::kPrinting;
  std::string printer;         ///< its name (procedure::PrinterName)
  std::string run;             ///< of the print: its file is trammel_<run>.gcode
  std::string started;         ///< date and time, for people
  std::int64_t printed_s = 0;  ///< seconds since 1970 at which the print ended; 0: not yet
  std::vector<StartedTool> tools;
};

/// Whole and on the disk before it returns. Errors (kInput) name the file.
[[nodiscard]] Result<void> WriteStart(const std::filesystem::path& folder,
                                      const StartRecord& record);

/// Errors (kInput): not there, or not written by a guided start; both name what to do.
[[nodiscard]] Result<StartRecord> ReadStart(const std::filesystem::path& folder);

/// A sheet that was printed, or begun, by a guided start.
struct StartedSheet {
  std::filesystem::path folder;
  StartRecord record;
  /// Seconds since 1970, not later than the end of its print: a scan of it is not older.
  std::int64_t since_s = 0;
};

/// The sheet of such a folder. Errors: as ReadStart.
[[nodiscard]] Result<StartedSheet> ReadStartedSheet(const std::filesystem::path& folder);

/// The sheet that was last begun on a printer, of those in the folders of `recordings`. Folders
/// without a start.json, or with one that cannot be read, do not count. Errors (kInput): none.
/// @param printer  its name (procedure::PrinterName)
[[nodiscard]] Result<StartedSheet> LastStart(const std::filesystem::path& recordings,
                                             const std::string& printer);

}  // namespace trammel::files
