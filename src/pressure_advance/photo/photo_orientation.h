// Sides of a photo, from the picture and from the lines.
#pragma once

#include <optional>
#include <span>
#include <string>
#include <vector>

#include "pressure_advance/photo/photo_reader.h"
#include "pressure_advance/photo/photo_segments.h"
#include "pressure_advance/profile/line_profile.h"
#include "vision/image.h"

namespace trammel::pressure_advance {

/// Direction from one end of the pattern to the other, in the photo.
struct Heading {
  double x = 0, y = 0;  ///< unit vector
};

/// Computes the heading from the middle of a1 and a2 to that of b1 and b2. REQUIRES that they
/// differ.
[[nodiscard]] Heading HeadingBetween(const vision::PointPx& a1, const vision::PointPx& a2,
                                     const vision::PointPx& b1, const vision::PointPx& b2);

/// Computes a heading's component towards a side, -1 … 1.
[[nodiscard]] double Towards(const Heading& heading, PhotoSide side);

/// Returns the side nearest to a heading's direction.
[[nodiscard]] PhotoSide SideTowards(const Heading& heading);

/// Sides of a photo at which a rectified part of it has its lower and its right edge.
struct PartSides {
  PhotoSide down, right;
};

/// @param corners  top left, top right, bottom right, bottom left of the part, px of the photo
[[nodiscard]] PartSides SidesOf(const vision::Quad& corners);

/// True if a side is along a heading, in either sense, not across it.
[[nodiscard]] bool IsAlong(const Heading& heading, PhotoSide side);

/// Returns the sides along a heading, for a message: "bottom or top".
[[nodiscard]] std::string SidesAlong(const Heading& heading);

/// Returns the assumed side of the first line if none is given.
[[nodiscard]] PhotoSide UsualSide(const Heading& down);

[[nodiscard]] PhotoSide Opposite(PhotoSide side);

/// Evidence of the lines on an assumed orientation.
struct OrientationReading {
  std::string refusal;
  bool reversed = false;     ///< printed from right to left
  bool upside_down = false;  ///< the first line lies at the other side, for sure
  std::optional<FoundSegments> segments;
  ShownPart shown;  ///< part of the lines between their ends as taken
};

/// Determines the lines' printed start, and a reversal of their order.
/// @param along           heading of the profiles' positions.
/// @param from            assumed side of the first profile's line.
/// @param order_on_trust  true if that needs no evidence.
/// @param parts           as for ReadTrend.
[[nodiscard]] OrientationReading ReadOrientation(const std::vector<LineProfile>& profiles,
                                                 const PhotoOptions& options, const Heading& along,
                                                 PhotoSide from, bool order_on_trust,
                                                 std::span<const ShownPart> parts);

}  // namespace trammel::pressure_advance
