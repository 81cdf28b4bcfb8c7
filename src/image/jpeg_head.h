// What a JPEG says before its entropy-coded data, as far as cameras write it.
#pragma once

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "image/huffman_codes.h"
#include "image/jpeg_place.h"

namespace trammel::image {

inline constexpr std::size_t kMostColours = 3;  // components, as cameras write them

struct JpegMarker {
  enum : std::uint8_t {
    kBaseline = 0xC0,
    kHuffmanTables = 0xC4,
    kStart = 0xD8,
    kEnd = 0xD9,
    kScan = 0xDA,
    kQuantisation = 0xDB,
    kRestarts = 0xDD,
    kJfif = 0xE0,
    kAdobe = 0xEE,
    kLastApplication = 0xEF,
    kComment = 0xFE,
  };
};

struct JpegComponent {
  std::uint8_t id = 0;
  int across = 1;  ///< blocks of an MCU
  int down = 1;
  std::size_t dc = 0;  ///< of the tables
  std::size_t ac = 0;

  [[nodiscard]] std::size_t codes() const { return 2 * dc + ac; }  ///< number of the pair
};

struct HuffmanTables {
  std::array<HuffmanTable, 2> dc;
  std::array<HuffmanTable, 2> ac;
};

/// What is needed of the markers before the scan's data.
struct JpegHead {
  int width_px = 0;
  int height_px = 0;
  int restart_mcus = 0;  ///< 0: none
  std::size_t components = 0;
  std::array<JpegComponent, kMostColours> component;
  HuffmanTables tables;
  /// Segments that an excerpt has, too, with their markers.
  std::vector<std::span<const std::uint8_t>> copied;
  std::span<const std::uint8_t> frame;  ///< the frame's segment, behind its marker
  std::span<const std::uint8_t> scan;   ///< likewise
  std::span<const std::uint8_t> data;   ///< behind the scan's header

  [[nodiscard]] JpegGrid grid() const {
    JpegGrid grid{width_px, height_px, 8, 8};
    for (std::size_t c = 0; c < components; ++c) {
      grid.mcu_width = std::max(grid.mcu_width, 8 * component[c].across);
      grid.mcu_height = std::max(grid.mcu_height, 8 * component[c].down);
    }
    return grid;
  }
};

/// Reads the markers up to the scan's data; false where any is not as cameras write it.
[[nodiscard]] bool ReadHead(std::span<const std::uint8_t> jpeg, JpegHead& head);

}  // namespace trammel::image
