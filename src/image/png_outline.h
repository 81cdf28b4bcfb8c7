// The outline of a PNG: what its header says, before a decoder is let at it.
#pragma once

#include <cstdint>
#include <span>

#include "base/result.h"

namespace trammel::image {

struct PngOutline {
  std::uint32_t width_px = 0;   ///< 1 … 2147483647
  std::uint32_t height_px = 0;  ///< 1 … 2147483647
  int bits = 8;                 ///< of a pixel
};

/// Reads the header alone. Errors (kInput): there is none, or it states no size.
[[nodiscard]] Result<PngOutline> OutlineOfPng(std::span<const std::uint8_t> bytes);

/// Refuses a size that so few bytes cannot hold: packing makes a picture smaller by a factor of
/// 1032 at most.
[[nodiscard]] Result<void> CheckCost(const PngOutline& outline, std::size_t bytes);

}  // namespace trammel::image
