// A whole file in memory.
#pragma once

#include <cstdint>
#include <filesystem>
#include <vector>

#include "base/result.h"

namespace trammel::machine {

/// Errors (kInput): it is no regular file, cannot be read, or has more than `most_bytes`. The
/// messages do not name it.
[[nodiscard]] Result<std::vector<std::uint8_t>> ReadFileBytes(const std::filesystem::path& path,
                                                              std::int64_t most_bytes);

}  // namespace trammel::machine
