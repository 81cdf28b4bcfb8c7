// The folder of a guided start: the plan, the drawing, the scan, the answer, the page.
#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "base/result.h"
#include "tool_offset/commands/offset_reading.h"
#include "tool_offset/files/start_file.h"
#include "tool_offset/sheet/sheet_gcode.h"
#include "tool_offset/sheet/sheet_plan.h"

namespace trammel::app {

/// Writes the G-code and the drawing. Errors name the file.
[[nodiscard]] Result<void> WriteSheet(const std::filesystem::path& folder,
                                      const tool_offset::SheetPlan& plan,
                                      const tool_offset::SheetGcode& gcode);

/// Takes away what WriteSheet wrote, where nothing was printed of it.
void RemoveSheet(const std::filesystem::path& folder);

/// Where a scan may be put: scan/ of the folder, made where it is missing.
[[nodiscard]] Result<std::filesystem::path> ScanFolderOf(const std::filesystem::path& folder);

/// Reads scans of one printed sheet, and keeps the first that answers.
class SheetReader {
 public:
  /// @param printer  the name under which the result is listed
  SheetReader(std::filesystem::path folder, tool_offset::SheetPlan plan, files::StartRecord record,
              ReadingOptions reading);

  /// Whether the file answers: then its copy, result.json, report.html and start.json are in the
  /// folder, a line is in history.jsonl beside it, and the answer stands on standard output.
  /// Errors: kInput of a file that is no page, kMeasurement of a page that is refused or shows no
  /// tool, with why; what cannot be written.
  [[nodiscard]] Result<bool> Read(const std::filesystem::path& scan);

  /// Of the scan that answered.
  [[nodiscard]] bool all_good() const { return all_good_; }

 private:
  [[nodiscard]] Result<std::filesystem::path> Keep(const std::filesystem::path& scan) const;

  std::filesystem::path folder_;
  tool_offset::SheetPlan plan_;
  files::StartRecord record_;
  ReadingOptions reading_;
  bool all_good_ = false;
};

}  // namespace trammel::app
