// Pictures of ring-coded targets for tests: their own drawing, by area.
#pragma once

#include <cstdint>
#include <vector>

#include "base/page.h"
#include "base/random.h"

namespace trammel::test {

/// A target's place in a picture: a plane seen through an affine map, or through a homography.
struct DrawnTarget {
  /// Picture from target plane, in radii of the disc: (x, y, w) = H (u, v, 1), px.
  double h[3][3] = {{10, 0, 50}, {0, 10, 50}, {0, 0, 1}};
  int bits = 0;            ///< 0: a plain disc
  std::uint32_t word = 0;  ///< bit k: the k-th segment, clockwise from +u
};

/// Centre, radius (px), and foreshortened by cos(tilt) along the direction `towards_rad`.
DrawnTarget AffineTarget(double column, double row, double radius, double tilt_rad = 0,
                         double towards_rad = 0, double turn_rad = 0);

/// A target on a plane seen by a pinhole camera: `radius` and `distance` in one unit, the disc's
/// middle `off_axis_rad` beside the camera's axis towards `off_towards_rad`, the plane tilted
/// against the line of sight by `tilt_rad` towards `tilt_towards_rad`, the target turned in it.
/// (column, row): where the disc's middle is seen. `mirrored`: as in a mirror.
struct PinholeView {
  double focal_px = 2813;
  double distance = 300;
  double radius = 5;
  double tilt_rad = 0;
  double tilt_towards_rad = 0;
  double turn_rad = 0;
  double off_axis_rad = 0;
  double off_towards_rad = 0;
  bool mirrored = false;
};
DrawnTarget PinholeTarget(double column, double row, const PinholeView& view);

/// Middle of the ellipse that is the disc's image.
struct Place {
  double column = 0;
  double row = 0;
};
Place DiscMiddle(const DrawnTarget& target);

/// A lamp's image in a glossy surface: light on top, falling off as a Gaussian.
struct Gloss {
  double column = 0;
  double row = 0;
  double size_px = 10;
  double grey = 0;  ///< at the centre
};

/// A shadow on one side of a line through a point: of the light, `left` is left.
struct Shadow {
  double column = 0;
  double row = 0;
  double towards_rad = 0;  ///< the shadow's side
  double soft_px = 1;      ///< the edge's standard deviation
  double left = 1;
};

struct Look {
  double paper = 200;     ///< grey level
  double ink = 50;        ///< disc and ring
  double blur_px = 0.5;   ///< Gaussian, standard deviation, beside the pixel's own area
  double gradient_x = 0;  ///< relative, per px, about the picture's middle
  double gradient_y = 0;
  Gloss gloss = {};
  Shadow shadow = {};
};

/// Grey levels, not rounded, by row: the pixels' covered area, then blurred, then lit.
struct GreyImage {
  int width = 0;
  int height = 0;
  std::vector<double> values;
};
GreyImage Draw(int width, int height, const std::vector<DrawnTarget>& targets, const Look& look);

/// Adds noise, rounds and clamps to 0 … 255.
Page Expose(const GreyImage& image, double noise, Random& random);

/// Discs, rings in pieces, bars, lines and checkerboards of random shades, and noise.
Page Clutter(int width, int height, Random& random);

}  // namespace trammel::test
