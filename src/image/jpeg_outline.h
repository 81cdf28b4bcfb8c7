// The outline of a JPEG: what its markers say, before a decoder is let at it.
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>

#include "base/result.h"

namespace trammel::image {

/// What its markers say of the first picture in the bytes.
struct JpegOutline {
  int width_px = 0;        ///< >= 1
  int height_px = 0;       ///< >= 1
  int components = 0;      ///< >= 1
  bool whole = false;      ///< coefficients are kept for all of the picture (progressive, or one
                           ///< component after the other): two bytes each
  std::int64_t scans = 0;  ///< passes over the picture; one where it is not progressive
};

/// Walks the markers as decoders do, without decoding. Errors (kInput): no header that states a
/// size, or one that decoders would read differently.
[[nodiscard]] Result<JpegOutline> OutlineOf(std::span<const std::uint8_t> bytes);

/// Refuses what would cost a decoder far more than such a picture should: more than 100 scans, more
/// than 4000 million pixels in all scans, and sizes that so few bytes cannot hold (512 pixels a
/// byte are the most that the format can). Messages say which.
[[nodiscard]] Result<void> CheckCost(const JpegOutline& outline, std::size_t bytes);

}  // namespace trammel::image
