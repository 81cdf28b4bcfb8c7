// The result of a command as a file: what --result writes, and what a recording keeps.
#pragma once

#include <filesystem>
#include <nlohmann/json.hpp>
#include <string>

#include "app/output_files.h"
#include "base/result.h"
#include "measurement/outcome.h"

namespace trammel::app {

/// An outcome with what its instrument says beside it.
struct ResultFile {
  measurement::Outcome outcome;
  nlohmann::ordered_json details;  ///< as --json prints it
};

/// As a file to write (docs/formats.md, result.json).
[[nodiscard]] OutputFile OutputOf(const std::filesystem::path& path, const ResultFile& result);

/// Writes result.json into the recording's folder. Errors name the file.
[[nodiscard]] Result<void> KeepInRecording(const std::filesystem::path& folder,
                                           const ResultFile& result);

}  // namespace trammel::app
