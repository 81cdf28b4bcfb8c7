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

/// Keys of [camera] with their values as TOML, in the order in which trammel config keys has them.
using CameraKeys = std::vector<std::pair<std::string, std::string>>;

/// The keys that a scan needs. REQUIRES a good verdict.
/// @param focus_height_mm  at which the mark was seen: the offsets hold there
[[nodiscard]] CameraKeys CameraKeysOf(const pressure_advance::SetupResult& result,
                                      double focus_height_mm);

/// The section, each value with its 95 % interval as a comment.
[[nodiscard]] std::string FormatCameraSection(const pressure_advance::SetupResult& result,
                                              double focus_height_mm);

/// The text of a trammel.toml with these keys in its section [camera], which is added at the end
/// where there is none. A key that stood there becomes a comment; all else stays as it is. Text
/// that spells the section in another way (dotted keys, an inline table) is not understood: parse
/// what comes back.
[[nodiscard]] std::string PutCameraKeys(std::string_view text, const CameraKeys& keys);

/// Reads `folder`/scan.json (docs/reference/formats.md). Does not open the videos.
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

/// Says of a folder with sweeps.json, which a scan writes before its first frame, why it cannot be
/// analysed: the scan ended in its first sweep, or no frame could be tied to the motion. Absent
/// where there is no sweeps.json. Kind: kMeasurement, or kInput where sweeps.json cannot be read.
[[nodiscard]] std::optional<Error> UnplacedRecording(const std::filesystem::path& folder);

}  // namespace trammel::files
