// The tables of an MP4 or MOV file, before libav makes room for what they state.
#pragma once

#include <cstdint>
#include <string>

namespace trammel::machine {

/// What is wrong with the tables of samples; empty where nothing is. A table of a few bytes may
/// state thousands of millions of samples, and libav takes memory for each of them.
[[nodiscard]] std::string InspectMovieTables(int fd, std::int64_t file_bytes);

}  // namespace trammel::machine
