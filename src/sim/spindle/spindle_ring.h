// A printed target, seen through the square of a pixel.
#pragma once

#include <array>
#include <cstdint>
#include <vector>

namespace trammel::sim {

/// A white disc in a dark ground, around it a ring of white and dark segments. Radii in mm, rising.
/// With bits = 0 there is no ring.
struct RingPattern {
  int bits = 0;            ///< segments of the ring, 0 … 31
  std::uint32_t word = 0;  ///< bit 0 is the first segment; 1 is white
  bool clockwise = true;   ///< the bits' order as one looks at the target
  double first_rad = 0;    ///< where the first segment begins, from the target's x, in their order
  double dot_radius_mm = 2;
  double ring_inner_mm = 4;
  double ring_outer_mm = 6;
  double ground_radius_mm = 7.5;
};

/// A wedge of something that lies on the target, counter-clockwise from `from_rad`.
struct HiddenWedge {
  double from_rad = 0;
  double extent_rad = 0;  ///< above 0, below pi
  double beyond_mm = 0;   ///< hides only what is farther from the middle
};

/// A square of the picture around a place of the target's plane. The columns of `by_pixel` are what
/// one pixel right and one pixel down are there, mm per px.
struct PixelOnTarget {
  std::array<double, 2> at_mm = {};
  std::array<std::array<double, 2>, 2> by_pixel = {};
};

/// Parts of the square, each 0 … 1: covered by the target at all; white; covered by a wedge.
struct TargetCover {
  double target = 0;
  double white = 0;
  double hidden = 0;
};

/// Splits the square where an edge runs through it into 4 x 4 and takes the edge for straight in
/// each: right to 2e-3 of the square's area at radii above 4 px, to 0.02 where two edges meet
/// (spindle_camera_test).
[[nodiscard]] TargetCover CoverOf(const RingPattern& pattern,
                                  const std::vector<HiddenWedge>& hidden,
                                  const PixelOnTarget& pixel);

}  // namespace trammel::sim
