// Reads and writes a recording: frames, camera, positions.
#pragma once

#include <filesystem>
#include <nlohmann/json_fwd.hpp>
#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "base/result.h"
#include "pressure_advance/recording/scan.h"
#include "pressure_advance/setup/solve_setup.h"

namespace trammel::files {

/// Keys of [camera] with their values as TOML, in the order of trammel config keys.
using CameraKeys = std::vector<std::pair<std::string, std::string>>;

/// Returns the keys that a scan needs. REQUIRES a good verdict.
/// @param focus_height_mm  height of the mark's pictures, at which the offsets are valid
[[nodiscard]] CameraKeys CameraKeysOf(const pressure_advance::SetupResult& result,
                                      double focus_height_mm);

/// Returns the section, each value with its 95 % interval as a comment.
[[nodiscard]] std::string FormatCameraSection(const pressure_advance::SetupResult& result,
                                              double focus_height_mm);

/// Sets these keys in the section [camera] of a trammel.toml's text; adds the section at the end if
/// it is missing. An old key becomes a comment; all else is unchanged. Other spellings of the
/// section (dotted keys, an inline table) are not supported: parse the returned text to check.
[[nodiscard]] std::string PutCameraKeys(std::string_view text, const CameraKeys& keys);

/// Reads `folder`/scan.json (docs/reference/formats.md). Does not open the videos. Errors state the
/// file, the JSON path, the value and the bound.
[[nodiscard]] Result<pressure_advance::Scan> ReadScan(const std::filesystem::path& folder);

/// Parses the same from text. `name` replaces the file's name in messages.
[[nodiscard]] Result<pressure_advance::Scan> ParseScan(const std::string& text,
                                                       const std::string& name);

/// Returns the text of a scan.json that ParseScan reads back as the same scan (the angle to 1e-9
/// degrees). An invalid scan is written unchanged for inspection; ParseScan rejects it.
/// @param extra  an object with the caller's own keys, or null: none. REQUIRES that they begin with
/// x_.
[[nodiscard]] std::string FormatScan(const pressure_advance::Scan& scan,
                                     const nlohmann::json& extra);

/// Returns the reason why a folder with sweeps.json, which a scan writes before its first frame,
/// cannot be analysed: the scan ended in its first sweep, or no frame could be assigned to the
/// motion. Absent if there is no sweeps.json. Kind: kMeasurement, or kInput if sweeps.json cannot
/// be read.
[[nodiscard]] std::optional<Error> UnplacedRecording(const std::filesystem::path& folder);

}  // namespace trammel::files
