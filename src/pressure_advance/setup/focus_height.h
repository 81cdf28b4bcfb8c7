// The height of the sharpest picture, from the stripe's width while the head rises.
#pragma once

#include <span>

#include "base/measured.h"
#include "pressure_advance/setup/observations.h"

namespace trammel::pressure_advance {

/// Fits width² = sharpest² + (spread · (z - focus))², a parabola in z, to widths as the plate has
/// them (width_px times what the picture has shrunk): blur adds in squares, and on the plate it
/// grows in proportion to the distance from the focus. In pixels it does not: at 34 mm from the
/// lens the parabola's lowest point would stand 0.6 mm too high. Where a halo or a tilted sheet
/// bends the widths otherwise, a cubic and a parabola of the nearer heights stand elsewhere: that
/// is part of the uncertainty. Cannot tell where the width does not bend, where those readings
/// differ by more than half a millimetre, or where the sharpest height is not among those seen;
/// then the reason says on which side to look.
[[nodiscard]] Measured FitFocusHeight(std::span<const SeenStripe> stripes,
                                      const Perspective& perspective);

}  // namespace trammel::pressure_advance
