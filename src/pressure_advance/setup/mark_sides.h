// The sides of a square ring, each placed by the middle of its bead.
#pragma once

#include <array>

#include "pressure_advance/setup/mark_reading.h"
#include "vision/image.h"

namespace trammel::pressure_advance {

/// About where the centre lines cross, in order along the outline.
struct SquareGuess {
  std::array<vision::PointPx, 4> corners;
  double bead_px = 0;
  bool darker = false;
};

/// Sections across each side but for its ends give the bead's middle, a robust line through them
/// the side. A fault where a side is not seen or the four make no square.
[[nodiscard]] MarkReading PlaceSides(const vision::GrayImage& image, const SquareGuess& guess);

}  // namespace trammel::pressure_advance
