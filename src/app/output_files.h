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

// The folder of a run, which is gone again where nothing came into it.

class NewFolder {
 public:
  /// Makes the folder that was asked for, else recordings/pressure_advance-<UTC>.
  /// Errors: it is there and not empty; it cannot be made.
  [[nodiscard]] static Result<NewFolder> Make(const std::filesystem::path& asked_for);

  NewFolder(NewFolder&& other) noexcept;
  NewFolder& operator=(NewFolder&& other) noexcept;
  /// Removes what it made and what is still empty: a run that was refused leaves nothing behind.
  ~NewFolder();

  [[nodiscard]] const std::filesystem::path& path() const { return path_; }

 private:
  NewFolder() = default;
  std::filesystem::path path_;
  std::vector<std::filesystem::path> made_;  // innermost first
};

// The result of a command as a file: what --result writes, and what a recording keeps.

/// An outcome with what its instrument says beside it.
struct ResultFile {
  measurement::Outcome outcome;
  nlohmann::ordered_json details;  ///< as --json prints it
};

/// As a file to write (docs/reference/formats.md, result.json).
[[nodiscard]] OutputFile OutputOf(const std::filesystem::path& path, const ResultFile& result);

/// Writes result.json into the recording's folder. Errors name the file.
[[nodiscard]] Result<void> KeepInRecording(const std::filesystem::path& folder,
                                           const ResultFile& result);

// Whether a file was measured before, by the copies that recordings keep.

/// The recording among those of a folder that keeps the same bytes under one of the names; empty:
/// none. Errors (kInput): the folder cannot be read.
[[nodiscard]] Result<std::filesystem::path> FindKeptCopy(const std::filesystem::path& recordings,
                                                         std::span<const std::string> names,
                                                         std::string_view bytes);

}  // namespace trammel::app
