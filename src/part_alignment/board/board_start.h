// Computes the first guess of a calibration by a board: linear, from pictures at one angle of the
// spindle.
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
  /// Observations with misread codes: far from the position that the others of their picture
  /// predict.
  std::vector<std::size_t> strays;
};

/// Fits a pin-hole with a bent lens from translations alone. H (mark - place) ~ pixel is linear in
/// H and H · mark (direct linear transform); the bend is searched for. Then finds the marks, and
/// the camera's place across the axis from pictures at other angles.
[[nodiscard]] BoardStart StartBoard(const BoardNetwork& network);

/// Drops strays and all that the first guess does not place.
void UseStart(const BoardStart& start, BoardNetwork& network);

}  // namespace trammel::part_alignment
