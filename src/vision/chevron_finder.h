// Finds nested chevrons in a photo: equally spaced stripes that turn by a right angle.
#pragma once

#include <optional>
#include <span>

#include "base/frame.h"
#include "vision/comb_finder.h"
#include "vision/image.h"

namespace trammel::vision {

/// Nested chevrons. Plane coordinates: unit is the spacing of neighbouring apexes, x along the
/// apexes towards which they point, y across. The middle of chevron k is x = k - |y|.
struct FoundChevrons {
  Homography photo_from_plane;  ///< does not mirror: y is to the right of x as seen
  int count = 0;                ///< chevrons k = 0 … count - 1, all of them seen
  double irregularity = 0;      ///< rms deviation of the arms from the plane's model, spacings
};

/// Half of the arms' extent along y that is searched, in spacings: the patterns in use have 4.6 to
/// 5.9 within their frame.
inline constexpr double kChevronReach = 4.2;

/// Searches two combs of stripes that meet at right angles, the homography that explains both, and
/// the row in which they meet; then counts the chevrons.
/// @param photo  8-bit BGR. REQUIRES at least 16 px each way.
/// @param combs  of the photo
/// @returns nothing where there are fewer than 6.
[[nodiscard]] std::optional<FoundChevrons> FindChevrons(const BgrView& photo,
                                                        std::span<const FoundComb> combs);

}  // namespace trammel::vision
