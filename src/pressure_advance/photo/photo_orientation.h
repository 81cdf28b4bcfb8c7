// Which side of a photo is which: what the picture says, and what the lines say.
#pragma once

#include <optional>
#include <span>
#include <string>
#include <vector>

#include "pressure_advance/photo/photo_eye.h"
#include "pressure_advance/photo/photo_segments.h"
#include "pressure_advance/profile/line_profile.h"
#include "vision/image.h"

namespace trammel::pressure_advance {

/// The direction from one end of the pattern to another, in the photo.
struct Heading {
  double x = 0, y = 0;  ///< unit vector
};

/// From the middle of a1 and a2 to that of b1 and b2. REQUIRES that they differ.
[[nodiscard]] Heading HeadingBetween(const vision::PointPx& a1, const vision::PointPx& a2,
                                     const vision::PointPx& b1, const vision::PointPx& b2);

/// How far a heading goes towards a side of the picture, -1 … 1.
[[nodiscard]] double Towards(const Heading& heading, PhotoSide side);

/// The side that a heading goes towards most.
[[nodiscard]] PhotoSide SideTowards(const Heading& heading);

/// Whether a side is along a heading, one way or the other, rather than across it.
[[nodiscard]] bool IsAlong(const Heading& heading, PhotoSide side);

/// The sides along a heading, for a message: "bottom or top".
[[nodiscard]] std::string SidesAlong(const Heading& heading);

/// The side at which the first line is taken to lie where none is given.
[[nodiscard]] PhotoSide UsualSide(const Heading& down);

[[nodiscard]] PhotoSide Opposite(PhotoSide side);

/// What the lines say of an orientation that is taken for the right one.
struct OrientationReading {
  std::string refusal;
  bool reversed = false;     ///< printed from right to left
  bool upside_down = false;  ///< the first line lies at the other side, for sure
  std::optional<FoundSegments> segments;
  ShownPart shown;  ///< part of the lines between their ends as taken
};

/// Which end of the lines is their printed start, and whether the order is the other way round.
/// @param along           heading of the profiles' positions.
/// @param from            the side at which the first profile's line is taken to lie.
/// @param order_on_trust  whether that needs no evidence.
/// @param parts           as for ReadTrend.
[[nodiscard]] OrientationReading ReadOrientation(const std::vector<LineProfile>& profiles,
                                                 const PhotoOptions& options, const Heading& along,
                                                 PhotoSide from, bool order_on_trust,
                                                 std::span<const ShownPart> parts);

}  // namespace trammel::pressure_advance
