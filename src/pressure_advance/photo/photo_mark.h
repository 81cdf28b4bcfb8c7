// The mark in a corner of the printed frame, which says where the first line begins.
#pragma once

#include <optional>

#include "vision/image.h"
#include "vision/line_pattern.h"

namespace trammel::pressure_advance {

/// The corner of a rectified picture in which the frame is filled: that of the first line's start.
struct MarkedCorner {
  bool bottom = false;
  bool right = false;
};

/// Looks between the outer lines and the bars beyond them, at both ends of the lines, for the one
/// corner that is filled before its bar while the line's other end is plate there. The mark's
/// strokes may lie apart, as a starved printer lays them. A string or a blob is narrower than what
/// is asked of a mark: all of a tenth of the line, one and a half beads deep.
/// @param contrast  filament higher than plate.
/// @returns nothing where no corner stands out, or more than one.
[[nodiscard]] std::optional<MarkedCorner> FindMark(const vision::GrayImage& contrast,
                                                   const vision::LinePattern& line_pattern);

}  // namespace trammel::pressure_advance
