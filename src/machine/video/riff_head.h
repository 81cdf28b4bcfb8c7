// The first bytes of an AVI file.
#pragma once

#include <cstdint>
#include <span>
#include <string>

namespace trammel::machine {

/// What is wrong with an AVI's first bytes; empty where nothing is.
/// @param unfinished  becomes whether its recorder was killed before it could state a size.
[[nodiscard]] std::string InspectRiff(std::span<const std::uint8_t> start, std::int64_t file_bytes,
                                      bool& unfinished);

}  // namespace trammel::machine
