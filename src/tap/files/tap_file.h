// Recorded taps: what Klipper and its forks send as dump_taps, and CSV.
#pragma once

#include <cstddef>
#include <filesystem>
#include <string>
#include <string_view>
#include <vector>

#include "base/result.h"
#include "tap/samples/tap.h"

namespace trammel::files {

/// More than a tap of ten minutes at 2000 samples per second has.
inline constexpr std::size_t kMostTapSamples = 1'200'000;

/// Reads every tap of a file (docs/reference/formats.md): JSON with one tap or a list of them, JSON
/// lines, or CSV with one tap, whose moves are read from `<stem>.moves.csv` beside it or derived
/// from z. What the samples hold is not judged: that is the analysis' part.
/// @returns at least one tap, in the file's order. Errors name file, tap, key, value and remedy.
[[nodiscard]] Result<std::vector<tap::Recording>> ReadTaps(const std::filesystem::path& file);

/// The same from JSON or JSON lines already read. `name` stands for the file in messages.
[[nodiscard]] Result<std::vector<tap::Recording>> ParseTaps(std::string_view text,
                                                            const std::string& name);

}  // namespace trammel::files
