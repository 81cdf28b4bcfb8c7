// Files that a command is about to write.
#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "base/result.h"

namespace trammel::app {

/// An error that names the first of the paths that is there already, unless `force`, that no file
/// is to be written to (files/new_file.h), or that comes twice. Looks before anything is written:
/// all or none.
[[nodiscard]] Result<void> RefuseToOverwrite(const std::vector<std::filesystem::path>& paths,
                                             bool force);

/// Where a report is to go.
struct ReportFiles {
  std::string report = {};   ///< HTML file to write; empty: none
  std::string figures = {};  ///< folder for each figure as PNG and SVG; empty: none
  std::string picture = {};  ///< PNG of the figure that shows the answer; empty: none
  std::string result = {};   ///< result.json to write; empty: none
  bool force = false;        ///< overwrite files
};

/// Whether the files can be written, asked before the work rather than behind it: minutes of it
/// need not go without their report. A result replaces nothing but a result, even with `force`.
/// Errors name the option.
[[nodiscard]] Result<void> CheckOutputs(const ReportFiles& outputs);

struct OutputFile {
  std::filesystem::path path;
  std::string bytes;
};

/// Writes all of them, or none where one is there already, unless `force`.
[[nodiscard]] Result<void> WriteOutputs(const std::vector<OutputFile>& outputs, bool force);

}  // namespace trammel::app
