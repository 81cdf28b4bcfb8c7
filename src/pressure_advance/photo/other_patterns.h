// Finds a further pattern in a photo in which one was found.
#pragma once

#include <cstddef>
#include <optional>
#include <span>

#include "base/frame.h"
#include "pressure_advance/photo/photo_lines.h"
#include "pressure_advance/photo/photo_search.h"
#include "pressure_advance/profile/line_profile.h"
#include "vision/chevron_finder.h"
#include "vision/image.h"

namespace trammel::pressure_advance {

/// Pattern beside the one that was found; px of the photo.
struct OtherPattern {
  std::optional<vision::FoundChevrons> chevrons;  ///< absent: lines
  PhotoLines lines;                               ///< without a problem if there are no chevrons

  [[nodiscard]] std::size_t count() const;  ///< of the lines or corners
};

/// Returns the photo with an outlined pattern and its numbers painted over.
/// @param outline  px of the photo, at least 3 corners; numbers lie at most a fifth beyond it
[[nodiscard]] Frame WithoutPattern(const BgrView& photo, std::span<const vision::PointPx> outline);

/// Searches chevrons and lines in the rest of a photo.
/// @param outline  of the pattern that was found, as for WithoutPattern; empty: none was
/// Cost: about 1 s, in a picture that is reduced to 2000 px.
/// REQUIRES a photo of at least 16 px each way.
[[nodiscard]] std::optional<OtherPattern> FindOtherPattern(
    const BgrView& photo, std::span<const vision::PointPx> outline);

/// Counts corners in a photo in which lines are expected and none were found, and the other way
/// round; 0: there are none. Takes the combs that were searched before.
/// REQUIRES a photo of at least 16 px each way.
[[nodiscard]] std::size_t CountOfOtherKind(PhotoSearch& photo, PatternForm expected);

/// True if lines lie in two groups with room for more between them, as those of two patterns one
/// above the other do.
[[nodiscard]] bool InTwoGroups(const vision::LinePattern& lines);

}  // namespace trammel::pressure_advance
