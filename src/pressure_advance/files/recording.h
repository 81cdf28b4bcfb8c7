// Recordings on disk: a folder with scan.json and the videos it names.
#pragma once

#include <filesystem>
#include <nlohmann/json_fwd.hpp>
#include <string>

#include "base/result.h"
#include "pressure_advance/recording/scan.h"

namespace trammel::files {

/// Reads `folder`/scan.json (docs/formats.md). Does not open the videos.
/// Every error names the file, the JSON path, the value and the bound.
[[nodiscard]] Result<pressure_advance::Scan> ReadScan(const std::filesystem::path& folder);

/// The same from text already read. `name` stands for the file in messages.
[[nodiscard]] Result<pressure_advance::Scan> ParseScan(const std::string& text,
                                                       const std::string& name);

/// The text of a scan.json that ParseScan reads back as the same scan (the angle to 1e-9 degrees).
/// A scan that is not valid is written as it is, for people to look at; ParseScan refuses it.
/// @param extra  an object with keys of one's own, or null: none. REQUIRES that they begin with x_.
[[nodiscard]] std::string FormatScan(const pressure_advance::Scan& scan,
                                     const nlohmann::json& extra);

}  // namespace trammel::files
