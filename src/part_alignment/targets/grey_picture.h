// Grey of coloured pixels, as the finders want it.
#pragma once

#include <cstdint>
#include <span>

#include "base/page.h"

namespace trammel::part_alignment {

/// Luma of BT.601; a grey camera's three equal channels come out as they were.
/// REQUIRES 3 · width · height bytes: BGR, row-major.
[[nodiscard]] Page GreyPicture(int width, int height, std::span<const std::uint8_t> bgr);

}  // namespace trammel::part_alignment
