// Noise of a picture, and the same picture with less of it.
#pragma once

#include <cstdint>
#include <vector>

#include "base/page.h"

namespace trammel::part_alignment {

/// Standard deviation of a pixel's noise, grey levels: from the median of |I(x + 1) - I(x - 1)|
/// over some rows, so edges hardly count where most of the picture is plain. A busy picture has
/// more.
/// @param picture  1 channel, at least 16 x 16 px.
[[nodiscard]] double PixelNoise(const PageView& picture);

/// (1, 2, 1) / 4 of three lines of `count` pixels, rounded up twice: compilers have an instruction
/// for that.
void Blend(const std::uint8_t* before, const std::uint8_t* middle, const std::uint8_t* after,
           int count, std::uint8_t* blended);

/// Binomial weights (1, 2, 1) / 4 along both axes: white noise is left with 3/8 of its standard
/// deviation, an edge's blur gains 0.5 px² of variance. Rounded at each of four steps, upwards:
/// grey levels gain up to 1.5. The border's pixels stay as they are.
/// @param samples  gets width x height values.
void Quieten(const PageView& picture, std::vector<std::uint8_t>& samples);

}  // namespace trammel::part_alignment
