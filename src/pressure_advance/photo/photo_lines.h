// Finds the printed pattern in a photo: the frame that contains equally spaced lines.
#pragma once

#include <string>

#include "base/frame.h"
#include "pressure_advance/photo/photo_reader.h"
#include "pressure_advance/photo/photo_search.h"
#include "vision/image.h"
#include "vision/line_pattern.h"

namespace trammel::pressure_advance {

/// Number of lines that sets the size at which unknown ones are searched: OrcaSlicer's PA Line
/// prints 51.
inline constexpr std::size_t kUsualLines = 51;

struct PhotoLines {
  std::string problem;   ///< why there is no pattern, and the remedy; empty if there is one
  vision::Quad corners;  ///< in px of PhotoSearch::picture, top left, top right, bottom right,
                         ///< bottom left of `picture`: outer corners of the frame, or of the lines'
                         ///< surroundings
  Frame picture;         ///< the pattern straight from above with some plate around, lines
                         ///< along the rows; never mirrored
  vision::GrayImage contrast;        ///< same size: filament higher than plate
  vision::LinePattern line_pattern;  ///< in px of `picture`
};

/// Rectifies each outline of filament to a top view, and selects the one whose inside is most like
/// a line pattern: first by the wanted number of rungs, then by the contrast of rows over columns.
/// If none has that number, searches equally spaced lines without a frame, and selects these unless
/// they are fewer.
/// Without PhotoOptions::framed, searches equally spaced lines that end side by side.
/// @param options  with at least 2 values: the number of lines expected; another number is found
/// and
///     reported as well.
[[nodiscard]] PhotoLines FindPhotoLines(PhotoSearch& photo, const PhotoOptions& options);

/// Counts the places for lines in a line pattern: its rungs and the empty places between them.
[[nodiscard]] std::size_t PlacesOf(const vision::LinePattern& line_pattern);

/// Pressure advance of each rung, from the first value's side on.
struct LineNames {
  std::vector<double> pressure_advance_s;  ///< one per rung; empty with a refusal
  std::string notice;
  std::string refusal;  ///< mismatch between list and lines
};

/// Assigns the list's values to the lines: one per position, or one per line if the list skips
/// exactly the missing lines. Rejects any other count: a missed line together with a false stripe
/// would shift all values between them.
[[nodiscard]] LineNames NameLines(const vision::LinePattern& line_pattern,
                                  const std::vector<double>& list, bool first_at_bottom);

}  // namespace trammel::pressure_advance
