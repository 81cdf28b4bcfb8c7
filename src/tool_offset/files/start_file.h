// start.json: what a guided start printed on which printer, and how far it came.
#pragma once

#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "base/result.h"
#include "tool_offset/offset/correction.h"

namespace trammel::files {

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
