// Recordings on disk: a folder with scan.json and the videos it names.
#pragma once

#include <filesystem>
#include <nlohmann/json_fwd.hpp>
#include <string>

#include "base/result.h"
#include "pressure_advance/scan.h"

namespace trammel::store {

/// Reads `folder`/scan.json (docs/formats.md). Does not open the videos.
/// Every error names the file, the JSON path, the value and the bound.
[[nodiscard]] Result<pressure_advance::Scan> ReadScan(const std::filesystem::path& folder);

/// The same from text already read. `name` stands for the file in messages.
[[nodiscard]] Result<pressure_advance::Scan> ParseScan(const std::string& text,
                                                       const std::string& name);

/// A scan.json that ParseScan reads back as the same scan. `extra`: an object whose keys begin with
/// x_, which readers ignore.
[[nodiscard]] std::string FormatScan(const pressure_advance::Scan& scan,
                                     const nlohmann::json& extra);

}  // namespace trammel::store
