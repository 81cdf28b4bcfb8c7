// Reads a comb's lines in a rectified picture.
#pragma once

#include "vision/image.h"
#include "vision/line_pattern.h"

namespace trammel::vision {

/// Searches beyond the first or the last line for plate, then a bar from rail to rail, then plate
/// again, with both rails continuing to the bar and ending there: no other line can follow. Each is
/// required along the whole line, since a smear, a string or the picture's border alone may look
/// like a bar.
/// @param contrast  filament higher than plate.
/// @param seen      of the same size: above 0.5 where the photo shows the plane.
/// @returns false if it is not visible, or there are fewer than 3 rungs or only one rail.
[[nodiscard]] bool FrameCloses(const GrayImage& contrast, const GrayImage& seen,
                               const LinePattern& pattern, bool beyond_last);

/// Positions of the comb in a rectified picture: its places are equally spaced.
struct CombPlaces {
  double first_y_px = 0;  ///< first place
  double pitch_px = 0;
  int count = 0;  ///< places that were found; up to two more on either side are looked at
};

/// Traces a line on each place, finds the rails, if any, and drops the frame's bars, at which the
/// rails end.
/// @param contrast  filament higher than the plate beside it.
/// @param seen      of the same size: above 0.5 where the photo shows the plane.
/// @param framed  false if no bar closes the pattern beside its outer lines: none is dropped.
/// @returns at least one rail, or a problem.
[[nodiscard]] LinePattern TraceComb(const GrayImage& contrast, const GrayImage& seen,
                                    const CombPlaces& places, bool framed = true);

}  // namespace trammel::vision
