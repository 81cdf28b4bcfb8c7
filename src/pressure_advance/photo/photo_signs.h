// Finds marks, bars and numbers around the lines of other tools' patterns: they show which line is
// the last and at which end the lines stop.
#pragma once

#include <optional>

#include "vision/image.h"
#include "vision/line_pattern.h"

namespace trammel::pressure_advance {

/// Sides in the rectified picture; absent where nothing shows them, or both alike.
struct PrintedSigns {
  std::optional<bool> last_at_bottom;
  std::optional<bool> end_at_right;
};

/// OrcaSlicer, Bambu Studio, Marlin's and Ellis' tools alike print beyond the last line two marks
/// at the changes of speed, or let the bars go on by one distance between lines; and numbers, or a
/// filled box for them, behind the ends of the lines.
/// @param contrast     filament higher than plate.
/// @param slow_before  PhotoOptions::slow_before
/// @param slow_after   PhotoOptions::slow_after
[[nodiscard]] PrintedSigns FindPrintedSigns(const vision::GrayImage& contrast,
                                            const vision::LinePattern& pattern, double slow_before,
                                            double slow_after);

}  // namespace trammel::pressure_advance
