// Writes JPEG.
#pragma once

#include <cstdint>
#include <optional>
#include <vector>

#include "base/page.h"
#include "base/result.h"

namespace trammel::image {

struct JpegOptions {
  int quality = 90;           ///< 1 … 100, libjpeg's scale
  std::optional<double> dpi;  ///< 1 … 65535, rounded; absent: the file does not say
  /// Optimises the Huffman tables by a second pass: fewer bytes, the same pixels.
  bool own_tables = false;
};

/// Encodes as baseline JPEG, grey or with chroma at half resolution in both directions.
/// @param jpeg  receives the bytes; its memory is reused.
/// Errors (kInput): a side of less than 1 or more than 65500 px. REQUIRES options in their ranges.
[[nodiscard]] Result<void> EncodeJpeg(const PageView& pixels, const JpegOptions& options,
                                      std::vector<std::uint8_t>& jpeg);

}  // namespace trammel::image
