// The parts of an AVI file of JPEG frames, in the order in which they are written.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

namespace trammel::image {

/// RIFF counts its bytes in 32 bits; many readers take them as signed.
inline constexpr std::size_t kMostAviBytes = 2'000'000'000;

struct AviForm {
  int width_px = 0;          ///< 1 … 65535
  int height_px = 0;         ///< 1 … 65535
  double frames_per_s = 30;  ///< > 0; for players
};

/// One frame in the file.
struct AviEntry {
  std::size_t at = 0;    ///< of its AviFrameHead(), from the file's start
  std::size_t size = 0;  ///< of the JPEG, in bytes
};

/// A number, as it lies in the file, and where.
struct AviPatch {
  std::size_t at = 0;
  std::array<std::uint8_t, 4> bytes{};
};

/// Everything before the first frame. Its sizes are 0, which says that the file was not finished:
/// readers then go by the file's own size.
[[nodiscard]] std::vector<std::uint8_t> AviHead(const AviForm& form);

/// What stands before a JPEG of `size` bytes; a 0 follows one of an odd size.
[[nodiscard]] std::array<std::uint8_t, 8> AviFrameHead(std::size_t size);

/// What stands behind the last frame.
[[nodiscard]] std::vector<std::uint8_t> AviIndex(std::span<const AviEntry> entries);

/// What a finished file states in its head.
/// @param frames_end  where the index begins.
[[nodiscard]] std::vector<AviPatch> AviSizes(std::size_t frames, std::size_t frames_end,
                                             std::size_t file_bytes);

}  // namespace trammel::image
