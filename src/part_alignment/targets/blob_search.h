// Blobs of one shade in a picture that may be discs, and their ellipses by rays.
#pragma once

#include <optional>
#include <vector>

#include "base/page.h"
#include "part_alignment/targets/disc_fit.h"

namespace trammel::part_alignment {

/// An ellipse about a middle.
struct Middle {
  double column_px = 0;
  double row_px = 0;
  /// From the unit circle to the ellipse, symmetric: (xx, xy; xy, yy), px.
  double xx = 0;
  double xy = 0;
  double yy = 0;
};

struct Blob {
  Middle middle;
  bool dark = false;  ///< than what is about it
};

struct BlobRules {
  double noise = 0;  ///< of the picture's pixels, grey levels
  double min_radius_px = 3;
  double max_radius_px = 150;
};

/// Finds outlines of what is darker or brighter than the mean of the pixels around it, and that are
/// ellipses by their moments: the axes are 1 : 4 at most. Small discs come with up to 1.5 px more
/// of radius. The largest come first; some come twice.
/// @param picture  1 channel, of Quieten.
[[nodiscard]] std::vector<Blob> FindBlobs(const PageView& picture, const BlobRules& rules);

/// The ellipse through where rays from the middle cross half the contrast, as a start for FitDisc.
/// Absent where they do not lie on one, or the contrast is less.
/// @param dark  whether the disc is darker than what is about it.
[[nodiscard]] std::optional<DiscModel> RoughDisc(const PageView& picture, const Middle& middle,
                                                 bool dark, double min_contrast);

}  // namespace trammel::part_alignment
