#include "machine/video/riff_head.h"

#include <fmt/format.h>

namespace trammel::machine {

std::string InspectRiff(std::span<const std::uint8_t> start, std::int64_t file_bytes,
                        bool& unfinished) {
  if (start.size() < 8) {
    return fmt::format("cut off after {} bytes; copy it again or record again", file_bytes);
  }
  const std::int64_t riff = start[4] + (std::int64_t{start[5]} << 8U) +
                            (std::int64_t{start[6]} << 16U) + (std::int64_t{start[7]} << 24U);
  // A recorder that was killed leaves 0 or all ones here; those say nothing.
  unfinished = riff == 0xFFFFFFFF || riff == 0;
  if (riff != 0xFFFFFFFF && riff + 8 > file_bytes) {
    return fmt::format(
        "truncated: its header announces {} bytes, there are {}; copy it again or record again",
        riff + 8, file_bytes);
  }
  return {};
}

}  // namespace trammel::machine
