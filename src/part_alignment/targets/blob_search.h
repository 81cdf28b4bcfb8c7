// Finds blobs of one shade in a picture that may be discs, and their ellipses by rays.
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
  /// Map from the unit circle to the ellipse, symmetric: (xx, xy; xy, yy), px.
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

/// Finds outlines darker or brighter than the mean of the pixels around them that are ellipses by
/// their moments: the axes are 1 : 4 at most. The radius of small discs is up to 1.5 px too large.
/// The largest are first; some appear twice.
/// @param picture  1 channel, of Quieten.
[[nodiscard]] std::vector<Blob> FindBlobs(const PageView& picture, const BlobRules& rules);

/// Fits the ellipse to the points where rays from the middle cross half the contrast, as a start
/// for FitDisc. Absent if they do not fit an ellipse, or the contrast is less.
/// @param dark  true if the disc is darker than its surroundings.
[[nodiscard]] std::optional<DiscModel> RoughDisc(const PageView& picture, const Middle& middle,
                                                 bool dark, double min_contrast);

}  // namespace trammel::part_alignment
