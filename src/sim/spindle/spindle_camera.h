// Printed target, seen through the square of a pixel.
#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include "base/page.h"
#include "base/random.h"
#include "base/result.h"
#include "sim/spindle/spindle_lens.h"

namespace trammel::sim {

/// White disc on a dark ground, with a ring of white and dark segments around it. Radii in mm,
/// rising. With bits = 0 there is no ring.
struct RingPattern {
  int bits = 0;            ///< segments of the ring, 0 … 31
  std::uint32_t word = 0;  ///< bit 0 is the first segment; 1 is white
  bool clockwise = true;   ///< the bits' order as one looks at the target
  double first_rad = 0;    ///< start of the first segment, from the target's x, in segment order
  double dot_radius_mm = 2;
  double ring_inner_mm = 4;
  double ring_outer_mm = 6;
  double ground_radius_mm = 7.5;
};

/// Wedge of an object that covers the target, counter-clockwise from `from_rad`.
struct HiddenWedge {
  double from_rad = 0;
  double extent_rad = 0;  ///< above 0, below pi
  double beyond_mm = 0;   ///< hides only what is farther from the middle
};

/// Pixel's square around a position in the target's plane. The columns of `by_pixel` are the steps
/// of one pixel right and one pixel down there, mm per px.
struct PixelOnTarget {
  std::array<double, 2> at_mm = {};
  std::array<std::array<double, 2>, 2> by_pixel = {};
};

/// Parts of the square, each 0 … 1: inside the target; white; covered by a wedge.
struct TargetCover {
  double target = 0;
  double white = 0;
  double hidden = 0;
};

/// Splits a square with an edge into 4 x 4 and assumes a straight edge in each: right to 2e-3 of
/// the square's area at radii above 4 px, to 0.02 where two edges meet (spindle_camera_test).
[[nodiscard]] TargetCover CoverOf(const RingPattern& pattern,
                                  const std::vector<HiddenWedge>& hidden,
                                  const PixelOnTarget& pixel);

/// Target in front of the camera. Its plane is its frame's x and y, its z faces the camera.
struct PlacedTarget {
  Place camera_from_target;
  RingPattern pattern;
  std::vector<HiddenWedge> hidden;
};

/// Grey levels of an evenly lit picture; displayable: 0 … 255.
struct SpindleLight {
  double white = 200;       ///< target's white
  double dark = 25;         ///< target's background
  double surface = 90;      ///< part's surface around it
  double hidden = 60;       ///< object on a target
  double vignetting = 0;    ///< loss of light at the corners, 0 … 0.9
  double gradient = 0;      ///< relative change across the picture's width, -1 … 1
  double gradient_rad = 0;  ///< gradient direction: 0 brighter to the right, pi / 2 downwards
};

/// Returns the light of LEDs beside the lens and retroreflecting targets: white shines, all else is
/// nearly black.
[[nodiscard]] SpindleLight RetroLight();

/// Other structures on the part. Counts are for the whole picture; 0: a plain surface.
struct SpindleClutter {
  double grain = 0;  ///< surface texture, relative, 1 sigma, 0 … 0.5
  int edges = 0;     ///< straight borders between lighter and darker parts of the surface
  int scratches = 0;
  int chips = 0;
  int holes = 0;              ///< round, with rims: what resembles a target most
  int words = 0;              ///< groups of letters and digits
  bool over_targets = false;  ///< scratches and chips lie on the targets too
};
/// Returns a machined surface with all of these, not over targets.
[[nodiscard]] SpindleClutter ShopClutter();

struct SpindleCameraTraits {
  double blur_px = 0.6;      ///< optics with defocus, Gaussian, 1 sigma, 0 … 20
  double motion_px = 0;      ///< length of the way during the exposure, 0 … 50
  double motion_rad = 0;     ///< motion direction in the picture
  double read_noise = 1;     ///< grey levels, 1 sigma, 0 … 50
  double shot_noise = 0.01;  ///< grey levels² per grey level: 255 / full well in electrons
};

struct SpindlePicture {
  SpindleLens lens;
  std::vector<PlacedTarget> targets;
  SpindleLight light;
  SpindleClutter clutter;
  SpindleCameraTraits optics;
};

/// Returns an 8-bit grey picture. Every pixel's line of sight meets the target's plane (no
/// approximation by an ellipse); edges are averaged over the pixel's area, then light, blur, noise
/// and rounding follow. Omits a target behind the camera or seen from its back.
/// Cost: below 1 s for 5 megapixels.
[[nodiscard]] Result<Page> TakePicture(const SpindlePicture& picture, const Random& random);

}  // namespace trammel::sim
