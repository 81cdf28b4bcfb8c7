// The height of the sharpest picture, from the stripe's width while the head rises.
#pragma once

#include <span>

#include "base/measured.h"
#include "pressure_advance/setup/observations.h"

namespace trammel::pressure_advance {

/// Fits width² = sharpest² + (spread · (z - focus))², a parabola in z: blur adds in squares, and
/// grows in proportion to the distance from the focus. Cannot tell where the width does not bend or
/// where the sharpest height is not among those seen; then the reason says on which side to look.
[[nodiscard]] Measured FitFocusHeight(std::span<const SeenStripe> stripes);

}  // namespace trammel::pressure_advance
