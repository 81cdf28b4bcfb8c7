// Files and folders that commands write.
#pragma once

#include <filesystem>
#include <nlohmann/json.hpp>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "base/result.h"
#include "measurement/outcome.h"

namespace trammel::app {

/// Returns an error that names the first path that exists already (unless `force`), is no valid
/// target (files/new_file.h), or is given twice. Checks all paths before anything is written.
[[nodiscard]] Result<void> RefuseToOverwrite(const std::vector<std::filesystem::path>& paths,
                                             bool force);

/// Output paths of a report.
struct ReportFiles {
  std::string report = {};   ///< HTML file to write; empty: none
  std::string figures = {};  ///< folder for each figure as PNG and SVG; empty: none
  std::string picture = {};  ///< PNG of the figure that shows the answer; empty: none
  std::string result = {};   ///< result.json to write; empty: none
  bool force = false;        ///< overwrite files
};

/// Checks that the files can be written, before minutes of work would end without a report. A
/// result replaces only a result, even with `force`. Errors name the option.
[[nodiscard]] Result<void> CheckOutputs(const ReportFiles& outputs);

struct OutputFile {
  std::filesystem::path path;
  std::string bytes;
};

/// Writes all files, or none if one exists already, unless `force`.
[[nodiscard]] Result<void> WriteOutputs(const std::vector<OutputFile>& outputs, bool force);

// Folder of a run, removed again if it stays empty.

class NewFolder {
 public:
  /// Creates the requested folder, else recordings/pressure_advance-<UTC>.
  /// Errors: it exists and is not empty; it cannot be created.
  [[nodiscard]] static Result<NewFolder> Make(const std::filesystem::path& asked_for);

  NewFolder(NewFolder&& other) noexcept;
  NewFolder& operator=(NewFolder&& other) noexcept;
  /// Removes the folders that it created and that are still empty: a rejected run leaves no trace.
  ~NewFolder();

  [[nodiscard]] const std::filesystem::path& path() const { return path_; }

 private:
  NewFolder() = default;
  std::filesystem::path path_;
  std::vector<std::filesystem::path> made_;  // innermost first
};

// Result of a command as a file: the output of --result, and the copy in a recording.

/// Outcome with the instrument's own details.
struct ResultFile {
  measurement::Outcome outcome;
  nlohmann::ordered_json details;  ///< as printed by --json
};

/// Converts a result to a file (docs/reference/formats.md, result.json).
[[nodiscard]] OutputFile OutputOf(const std::filesystem::path& path, const ResultFile& result);

/// Writes result.json into the recording's folder. Errors name the file.
[[nodiscard]] Result<void> KeepInRecording(const std::filesystem::path& folder,
                                           const ResultFile& result);

// Search for an earlier measurement of a file, by the copies in recordings.

/// Finds the recording in a folder that contains the same bytes under one of the names; empty:
/// none. Errors (kInput): the folder cannot be read.
[[nodiscard]] Result<std::filesystem::path> FindKeptCopy(const std::filesystem::path& recordings,
                                                         std::span<const std::string> names,
                                                         std::string_view bytes);

}  // namespace trammel::app
