// The first guess of a calibration by a board: linear, from pictures at one angle of the spindle.
#pragma once

#include <cstddef>
#include <vector>

#include "part_alignment/board/board_model.h"

namespace trammel::part_alignment {

enum class BoardStartFault {
  kNone,
  kFewPictures,  ///< no angle of the spindle has enough pictures
  kOneHeight,    ///< the spindle stays in one plane
  kShallow,      ///< and nearly so, and nothing follows
  kOneLine,      ///< it moves along one line
  kMirrored,     ///< no proper rotation sees the places from the stated side
  kLooksAway,    ///< the camera would look into the spindle
  kNoCamera,     ///< no pin-hole fits: columns and rows would have very different focal lengths
};

struct BoardStart {
  BoardStartFault fault = BoardStartFault::kNone;
  BoardState state;          ///< taper_from_camera without what the pictures do not tell
  double depth_mm = 0;       ///< extent of the spindle's places along its axis
  double width_mm = 0;       ///< across it
  std::vector<bool> placed;  ///< of the marks
  /// Far beside where the others of their picture put them: misread codes.
  std::vector<std::size_t> strays;
};

/// A pin-hole with a bent lens from translations alone: H (mark - place) ~ pixel is linear in H and
/// H · mark (direct linear transform); the bend is searched for. Then marks, then the camera's
/// place across the axis from pictures at other angles.
[[nodiscard]] BoardStart StartBoard(const BoardNetwork& network);

/// Leaves out what the first guess does not place, and strays.
void UseStart(const BoardStart& start, BoardNetwork& network);

}  // namespace trammel::part_alignment
