// The mixture of colours that tells filament from plate best.
#pragma once

#include <array>
#include <optional>

#include "base/frame.h"
#include "vision/image.h"

namespace trammel::vision {

/// Weights of blue, green and red; filament is higher than the plate beside it.
using ColourWeights = std::array<double, 3>;

/// Fisher's linear discriminant between filament and plate, of colours relative to their
/// surroundings, so that uneven light does not count as a difference.
/// @param picture   8-bit BGR.
/// @param filament  of the same size: 1 on filament, 0 beside it; may be wrong here and there.
/// @param surroundings_px  side of the window that counts as surroundings, >= 3.
/// @returns weights that put filament 100 above the plate on average; nothing where either covers
///          less than 5 % or their colours do not differ.
[[nodiscard]] std::optional<ColourWeights> FindContrast(const BgrView& picture,
                                                        const GrayImage& filament,
                                                        int surroundings_px);

/// The weighted sum of the colours of each pixel.
[[nodiscard]] GrayImage Mix(const BgrView& picture, const ColourWeights& weights);

}  // namespace trammel::vision
