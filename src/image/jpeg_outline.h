// Outline of a JPEG from its markers, before a decoder runs.
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>

#include "base/result.h"

namespace trammel::image {

/// Outline of the first picture in the bytes, from its markers.
struct JpegOutline {
  int width_px = 0;        ///< >= 1
  int height_px = 0;       ///< >= 1
  int components = 0;      ///< >= 1
  bool whole = false;      ///< coefficients are kept for all of the picture (progressive, or one
                           ///< component after the other): two bytes each
  std::int64_t scans = 0;  ///< passes over the picture; one where it is not progressive
};

/// Parses the markers as decoders do, without decoding. Errors (kInput): no header with a size, or
/// one that decoders would read differently.
[[nodiscard]] Result<JpegOutline> OutlineOf(std::span<const std::uint8_t> bytes);

/// Rejects pictures that cost a decoder far more than their size justifies: more than 100 scans,
/// more than 4000 million pixels in all scans, and sizes that so few bytes cannot hold (the
/// format's maximum is 512 pixels a byte). Messages name the limit.
[[nodiscard]] Result<void> CheckCost(const JpegOutline& outline, std::size_t bytes);

}  // namespace trammel::image
