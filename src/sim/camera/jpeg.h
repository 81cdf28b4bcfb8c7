// JPEG with the quality of cheap cameras.
#pragma once

#include <cstdint>
#include <vector>

#include "base/frame.h"

namespace trammel::sim {

/// Encodes into `jpeg`, reusing its memory. Baseline, chroma at half resolution in both directions.
/// REQUIRES 1 <= quality <= 100 and a view of 1 to 65500 px a side.
void EncodeJpeg(const BgrView& view, int quality, std::vector<std::uint8_t>& jpeg);

}  // namespace trammel::sim
