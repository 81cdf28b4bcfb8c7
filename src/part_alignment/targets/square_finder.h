// Finds square markers (original ArUco) in a picture, reads them and measures their centres.
#pragma once

#include "base/page.h"
#include "base/result.h"
#include "part_alignment/targets/square_code.h"
#include "part_alignment/targets/square_search.h"
#include "part_alignment/targets/target.h"

namespace trammel::part_alignment {

struct SquareFinderOptions {
  double min_side_px = 24;    ///< of the shortest side, 14 … 5000; smaller ones are rejected
  double max_side_px = 1000;  ///< of the longest, min_side_px … 5000; larger ones are not seen
  double min_contrast = 20;   ///< between border and surroundings, grey levels, 8 … 255
  bool mirrored = false;      ///< as FinderOptions::mirrored (ring_finder.h)
};

/// Memory of FindSquares, to be used again for the next picture.
struct SquareWorkspace {
  OutlineWorkspace outlines;
};

/// Method: docs/part-alignment.md, "Square markers". Outlines of dark things with four straight
/// sides are read in their own plane; each of the four outer edges is fitted to the pixels, and the
/// centre is where the diagonals between their crossings meet: perspective leaves it in place, so
/// that no eccentricity is to be corrected. What a lens bends over the marker's size is not taken
/// out here.
/// @param picture  8-bit grey: 1 channel, 16 … 32,767 px a side.
/// @returns `number` is the marker's id, `square` its outline; `disc` has the centre and half the
///          sides' lengths; `ring_start_rad` is the direction of its upper edge. Markers of the
///          dictionary that are not in the book are rejected as kWrongCode with their id.
/// Errors (kInput): a picture of another kind, options out of range, an empty book. A picture
/// without markers is a result with none.
/// Accuracy: root-mean-square error per axis within 1.5 of the Cramér-Rao bound of its outer edges
/// up to 30 degrees of tilt, 1.85 at 50 or with much blur; stated sigma within 0.8 … 1.4 of the
/// scatter, ragged edges too (square_finder_test).
[[nodiscard]] Result<FoundTargets> FindSquares(const PageView& picture, const SquareBook& book,
                                               const SquareFinderOptions& options,
                                               SquareWorkspace& workspace);

}  // namespace trammel::part_alignment
