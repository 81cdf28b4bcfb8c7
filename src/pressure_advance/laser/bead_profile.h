// From heights over the plate to the bead's cross-section in each frame.
#pragma once

#include <vector>

#include "pressure_advance/laser/plate_reference.h"
#include "pressure_advance/profile/line_profile.h"

namespace trammel::pressure_advance {

/// How pixels of the height map become lengths.
struct SectionScale {
  double length_per_row = 1;  ///< along the stripe
  double height_per_px = 1;   ///< of the surface, per pixel of shift
};

/// Width, height and area of the bead, one sample per frame.
///
/// The area is the sum of the heights over the rows that a bead of its size covers (FindReach), or
/// over all of its band where a swell stands clearly beyond the others', positive and negative
/// alike: so noise hardly biases it, it stays linear down to a bead of nothing, and a broken bead
/// reads 0. A frame where more than a third of the band is unseen in one piece is a gap, and so is
/// one whose bead reaches out of the picture.
/// @returns one sample per frame; position is left at 0.
[[nodiscard]] std::vector<ProfileSample> MeasureBead(const PlateHeights& plate,
                                                     const SectionScale& scale);

}  // namespace trammel::pressure_advance
