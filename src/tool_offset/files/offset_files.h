// Files of tool offsets: an open measurement, its steps, and the history of set offsets.
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
  double dx_mm = 0;  ///< actual line position minus that of the reference tool
  double dy_mm = 0;
  Interval dx95_mm = {};
  Interval dy95_mm = {};
};

struct OffsetFile {
  std::vector<MeasuredOffset> good;  ///< tools whose verdict is good
  std::vector<std::string> refused;  ///< a line for each of the others, with its reason
  measurement::Outcome result = {};
};

/// Reads a folder's result.json, or a stored result. Errors (kInput): missing, another
/// instrument's, an offset beyond 50 mm.
[[nodiscard]] Result<OffsetFile> ReadOffsetFile(const std::filesystem::path& path);

/// File in the state folder: the changes applied on any printer, from whatever folder.
inline constexpr std::string_view kOffsetHistoryFile = "offset-history.jsonl";

enum class OffsetStage {
  kBegun,    ///< about to be set: the old value is safe from here on
  kApplied,  ///< set, and read back
  kKept,     ///< survives a restart, too
  kUndone,   ///< taken back: what was new is old in this line, and what was old is set again
};

/// Change of a tool's offset on a printer.
struct OffsetChange {
  OffsetStage stage = OffsetStage::kBegun;
  std::string time;     ///< ISO 8601 with its zone
  std::string printer;  ///< address
  std::string source;   ///< the file with the measured offset, from the root
  int tool = 0;
  double dx_mm = 0;  ///< measured, and corrected
  double dy_mm = 0;
  tool_offset::KeptOffset old_offset;  ///< as stored in the firmware
  tool_offset::KeptOffset new_offset;
};

/// Appends a line and syncs it to the disk. Makes the folder. A torn last line stays unchanged, on
/// a line of its own. Errors (kInput) name the file and the reason.
[[nodiscard]] Result<void> AppendToHistory(const std::filesystem::path& path,
                                           const OffsetChange& change);

/// Reads all changes, oldest first; none if there is no file. Skips other and invalid lines: they
/// must never prevent setting an offset. Errors (kInput): not readable; larger than 64 MB; an
/// unknown format.
[[nodiscard]] Result<std::vector<OffsetChange>> ReadOffsetChanges(
    const std::filesystem::path& path);

inline constexpr std::string_view kStartFile = "start.json";

/// Progress of a start; each stage is on the disk before the next begins.
enum class StartStage {
  kPrinting,  ///< the sheet is about to be printed
  kPrinted,   ///< it lies on the bed
  kAnalysed,  ///< result.json is there
};

/// Tool of the sheet, with the printer's stored offset during the print.
struct StartedTool {
  int tool = 0;
  std::optional<tool_offset::KeptOffset> kept = {};  ///< absent: the printer does not tell
};

struct StartRecord {
  StartStage stage = StartStage::kPrinting;
  std::string printer;         ///< printer name (procedure::PrinterName)
  std::string run;             ///< print's run: its file is trammel_<run>.gcode
  std::string started;         ///< date and time, for people
  std::int64_t printed_s = 0;  ///< seconds since 1970 at which the print ended; 0: not yet
  std::vector<StartedTool> tools;
};

/// Writes the record, complete and synced to the disk. Errors (kInput) name the file.
[[nodiscard]] Result<void> WriteStart(const std::filesystem::path& folder,
                                      const StartRecord& record);

/// Reads the record. Errors (kInput): missing, or not written by a guided start; both name the
/// remedy.
[[nodiscard]] Result<StartRecord> ReadStart(const std::filesystem::path& folder);

/// Sheet whose print a guided start finished or began.
struct StartedSheet {
  std::filesystem::path folder;
  StartRecord record;
  /// Seconds since 1970, not later than the end of its print: a scan of it is newer.
  std::int64_t since_s = 0;
};

/// Reads the sheet of such a folder. Errors: as ReadStart.
[[nodiscard]] Result<StartedSheet> ReadStartedSheet(const std::filesystem::path& folder);

/// Finds the last sheet that was begun on a printer, in the folders of `recordings`. Skips folders
/// without a readable start.json. Errors (kInput): none.
/// @param printer  its name (procedure::PrinterName)
[[nodiscard]] Result<StartedSheet> LastStart(const std::filesystem::path& recordings,
                                             const std::string& printer);

}  // namespace trammel::files
