// Progress from one process to another: a line of JSON on standard error.
#pragma once

#include <optional>
#include <string>
#include <string_view>

#include "session/session.h"

namespace trammel::procedure {

/// {"progress":"scanning line 2 of 9","remaining_s":40,"phase":"scanning","done":0.111}: the text
/// always, the others where they are known. Without a line feed.
[[nodiscard]] std::string ProgressLine(const Progress& progress);

/// The same back; nothing where the line is none. Texts are cut at 1024 bytes, the phase at 32.
[[nodiscard]] std::optional<Progress> ParseProgressLine(std::string_view line);

}  // namespace trammel::procedure
