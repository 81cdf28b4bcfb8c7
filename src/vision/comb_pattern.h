// Reads a comb's lines in a rectified picture.
#pragma once

#include "vision/image.h"
#include "vision/line_pattern.h"

namespace trammel::vision {

/// Looks beyond the first or the last line for plate, then a bar from rail to rail, then plate
/// again, with both rails seen to run on to the bar and to end there: no other line can follow.
/// Each of these is asked for, all along the line, since a smear, a string or the picture's border
/// may look like a bar by itself.
/// @param contrast  filament higher than plate.
/// @param seen      of the same size: above 0.5 where the photo shows the plane.
/// @returns false where it is not seen, or fewer than 3 rungs or one rail only are.
[[nodiscard]] bool FrameCloses(const GrayImage& contrast, const GrayImage& seen,
                               const LinePattern& pattern, bool beyond_last);

/// Where the comb lies in a rectified picture: its places follow each other in equal steps.
struct CombPlaces {
  double first_y_px = 0;  ///< of the first place
  double pitch_px = 0;
  int count = 0;  ///< places that were found; up to two more on either side are looked at
};

/// Traces a line on each place, finds the rails where there are any, and drops the frame's bars, at
/// which the rails end.
/// @param contrast  filament higher than the plate beside it.
/// @param seen      of the same size: above 0.5 where the photo shows the plane.
/// @returns at least one rail, or a problem.
[[nodiscard]] LinePattern TraceComb(const GrayImage& contrast, const GrayImage& seen,
                                    const CombPlaces& places);

}  // namespace trammel::vision
