// What a camera's setup found, as the section [camera] of trammel.toml.
#pragma once

#include <string>
#include <string_view>
#include <utility>
#include <vector>

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

}  // namespace trammel::files
