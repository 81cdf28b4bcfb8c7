// Taps that `trammel tap watch` recorded beside the server: the newest, and one with its curve.
#pragma once

#include <cstddef>
#include <filesystem>
#include <nlohmann/json.hpp>
#include <string>

#include "base/result.h"

namespace trammel::service {

/// Key of the answer in a recorded tap.
inline constexpr const char* kTapAnswer = "x_trammel";

/// Returns a printer's newest taps of a folder's files tap…-TIME.jsonl, newest first: each `tap`
/// (its name for TapIn), and its answer (docs/reference/formats.md) without the curve. Reads at
/// most 32 MB from the end of the newest files. Lines without an answer are skipped.
/// @param printer  by procedure::PrinterName
[[nodiscard]] nlohmann::json NewestTaps(const std::filesystem::path& recordings,
                                        const std::string& printer, std::size_t last);

/// Returns one tap with its curve. Errors (kInput): there is none.
[[nodiscard]] Result<nlohmann::json> TapIn(const std::filesystem::path& recordings,
                                           const std::string& tap);

}  // namespace trammel::service
