// Finds the printed pattern in a photo: the frame that holds equally spaced lines.
#pragma once

#include <string>

#include "base/frame.h"
#include "vision/image.h"
#include "vision/line_pattern.h"

namespace trammel::pressure_advance {

struct PhotoLines {
  std::string problem;   ///< why there is no pattern, and what to do; empty where there is one
  vision::Quad corners;  ///< in px of the photo, top left, top right, bottom right, bottom left of
                         ///< `picture`: outer corners of the frame, or of the lines' surroundings
  Frame picture;         ///< the pattern straight from above with some plate around, lines
                         ///< along the rows; never mirrored
  vision::GrayImage contrast;        ///< same size: filament higher than plate
  vision::LinePattern line_pattern;  ///< in px of `picture`
};

/// Looks at each outline of filament straight from above, and keeps the one whose inside is most of
/// a line pattern: as many rungs as wanted first, then the strongest contrast of rows over columns.
/// Where none holds as many as wanted, looks for equally spaced lines by themselves, and keeps
/// these where they are not fewer.
/// @param wanted  number of lines expected, >= 2; another number is found and reported as well.
/// REQUIRES a photo of at least 16 px each way.
[[nodiscard]] PhotoLines FindPhotoLines(const BgrView& photo, std::size_t wanted);

/// How many lines a line pattern has room for: its rungs and the empty places between them.
[[nodiscard]] std::size_t PlacesOf(const vision::LinePattern& line_pattern);

/// The pressure advance of each rung, from the first value's side on.
struct LineNames {
  std::vector<double> pressure_advance_s;  ///< one per rung; empty with a refusal
  std::string notice;
  std::string refusal;  ///< why the list does not fit the lines
};

/// Names the lines by the list: one value per place, or one per line where the list jumps just
/// where lines are missing. Anything else is refused, because a line that was missed beside a
/// stripe that is none would shift all names between them.
[[nodiscard]] LineNames NameLines(const vision::LinePattern& line_pattern,
                                  const std::vector<double>& list, bool first_at_bottom);

}  // namespace trammel::pressure_advance
