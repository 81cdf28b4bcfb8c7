// Reads recorded taps: dump_taps of Klipper and its forks, and CSV.
#pragma once

#include <cstddef>
#include <filesystem>
#include <string>
#include <string_view>
#include <vector>

#include "base/result.h"
#include "tap/samples/tap.h"

namespace trammel::files {

/// Maximum number of samples: more than a tap of ten minutes at 2000 samples per second has.
inline constexpr std::size_t kMaxTapSamples = 1'200'000;

/// Reads every tap of a file (docs/reference/formats.md): JSON with one tap or a list of them, JSON
/// lines, or CSV with one tap, whose moves are read from `<stem>.moves.csv` beside it or derived
/// from z. Does not check the samples: the analysis does.
/// @returns at least one tap, in the file's order. Errors name file, tap, key, value and remedy.
[[nodiscard]] Result<std::vector<tap::Recording>> ReadTaps(const std::filesystem::path& file);

/// Parses taps from JSON or JSON lines. `name` is the file's name in messages.
[[nodiscard]] Result<std::vector<tap::Recording>> ParseTaps(std::string_view text,
                                                            const std::string& name);

}  // namespace trammel::files
