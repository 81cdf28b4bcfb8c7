// Finds the printed pattern in a photo: the frame that holds equally spaced lines.
#pragma once

#include <string>

#include "base/frame.h"
#include "vision/homography.h"
#include "vision/image.h"
#include "vision/ladder.h"

namespace trammel::pressure_advance {

struct PhotoLadder {
  std::string problem;   ///< why there is no pattern, and what to do; empty where there is one
  vision::Quad corners;  ///< outer corners of the frame in px of the photo: top left, top
                         ///< right, bottom right, bottom left of `picture`
  Frame picture;         ///< the pattern straight from above with some plate around, lines
                         ///< along the rows; never mirrored
  vision::GrayImage contrast;  ///< same size: filament higher than plate
  vision::Ladder ladder;       ///< in px of `picture`
};

/// Looks at each outline of filament straight from above, and keeps the one whose inside is most of
/// a ladder: as many rungs as wanted first, then the strongest contrast of rows over columns.
/// @param wanted  number of lines expected, >= 2; another number is found and reported as well.
/// REQUIRES a photo of at least 16 px each way.
[[nodiscard]] PhotoLadder FindPhotoLadder(const BgrView& photo, std::size_t wanted);

/// "found 20 lines, the PA list has 21 values …", with where lines seem to be missing.
[[nodiscard]] std::string DescribeCount(const vision::Ladder& ladder, std::size_t wanted);

}  // namespace trammel::pressure_advance
