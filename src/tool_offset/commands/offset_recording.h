// The folder of a guided start: the plan, the drawing, the scan, the answer, the page.
#pragma once

#include <filesystem>
#include <functional>
#include <string>
#include <vector>

#include "base/result.h"
#include "files/new_file.h"
#include "tool_offset/commands/offset_reading.h"
#include "tool_offset/files/offset_files.h"
#include "tool_offset/sheet/sheet_gcode.h"
#include "tool_offset/sheet/sheet_plan.h"

namespace trammel::app {

/// The G-code of a sheet, and its drawings beside it: .svg, .png.
[[nodiscard]] std::vector<std::filesystem::path> SheetFiles(const std::filesystem::path& gcode);

/// Writes these files. Errors name the file. @param path  of the G-code.
[[nodiscard]] Result<void> WriteSheet(const std::filesystem::path& path,
                                      const tool_offset::SheetPlan& plan,
                                      const tool_offset::SheetGcode& gcode,
                                      files::IfThere there = files::IfThere::kRefuse);

/// Removes what WriteSheet wrote, where nothing was printed of it.
void RemoveSheet(const std::filesystem::path& path);

/// The picture of the answer in the folder, for a printer's screen.
inline constexpr const char* kOffsetPicture = "answer.png";

/// Where a scan may be put: scan/ of the folder, made where it is missing.
[[nodiscard]] Result<std::filesystem::path> ScanFolderOf(const std::filesystem::path& folder);

/// Reads scans of one printed sheet, and keeps the first that answers.
class SheetReader {
 public:
  /// @param printer  the name under which the result is listed
  SheetReader(std::filesystem::path folder, tool_offset::SheetPlan plan, files::StartRecord record,
              ReadingOptions reading);

  /// Whether the file answers: then its copy, result.json, answer.png, report.html and start.json
  /// are in the folder, and the answer stands on standard output. Errors: kInput of a file that is
  /// no page, kMeasurement of a page that is refused or shows no tool, with why; what cannot be
  /// written.
  [[nodiscard]] Result<bool> Read(const std::filesystem::path& scan);

  /// The same of several files, which answer together. One that does not is told by `left_out`,
  /// with why; where none does, the first one's error comes back.
  [[nodiscard]] Result<bool> ReadTogether(const std::vector<std::filesystem::path>& scans,
                                          const std::function<void(const std::string&)>& left_out);

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
