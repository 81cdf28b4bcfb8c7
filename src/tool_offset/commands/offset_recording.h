// Folder of a guided start: the plan, the drawing, the scan, the result, the page.
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

/// Returns the paths of a sheet's G-code and of its drawings beside it: .svg, .png.
[[nodiscard]] std::vector<std::filesystem::path> SheetFiles(const std::filesystem::path& gcode);

/// Writes these files. Errors name the file. @param path  of the G-code.
[[nodiscard]] Result<void> WriteSheet(const std::filesystem::path& path,
                                      const tool_offset::SheetPlan& plan,
                                      const tool_offset::SheetGcode& gcode,
                                      files::IfThere there = files::IfThere::kRefuse);

/// Removes the files of WriteSheet, if nothing of the sheet was printed.
void RemoveSheet(const std::filesystem::path& path);

/// Picture of the result in the folder, for a printer's screen.
inline constexpr const char* kOffsetPicture = "answer.png";

/// Returns the folder for a scan: scan/ of the folder, created if missing.
[[nodiscard]] Result<std::filesystem::path> ScanFolderOf(const std::filesystem::path& folder);

/// Reads scans of one printed sheet, and stores the first that can be evaluated.
class SheetReader {
 public:
  /// @param printer  the name under which the result is listed
  SheetReader(std::filesystem::path folder, tool_offset::SheetPlan plan, files::StartRecord record,
              ReadingOptions reading);

  /// Reads a scan; true if the file answers. Then its copy, result.json, answer.png, report.html
  /// and start.json are in the folder, and the answer is on standard output. Errors: kInput of a
  /// file that is no page, kMeasurement of a page that is refused or shows no tool, with why;
  /// unwritable files.
  [[nodiscard]] Result<bool> Read(const std::filesystem::path& scan);

  /// Reads several files and evaluates them together. `left_out` reports each that fails, with the
  /// reason; if all fail, returns the first one's error.
  [[nodiscard]] Result<bool> ReadTogether(const std::vector<std::filesystem::path>& scans,
                                          const std::function<void(const std::string&)>& left_out);

  /// True if all tools of the scan that answered are good.
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
