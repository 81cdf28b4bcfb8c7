// Whether the frame around a comb closes beyond one of its outer lines.
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

}  // namespace trammel::vision
