// Where in the picture the laser crosses the bead, for recordings that do not say.
#pragma once

#include <optional>
#include <span>
#include <string>

#include "base/frame.h"
#include "pressure_advance/recording/scan.h"
#include "vision/laser_line.h"

namespace trammel::pressure_advance {

struct FoundCrop {
  std::optional<PixelRect> crop;  ///< in the recorded frame's coordinates
  std::string fault;              ///< why there is none
};

/// Finds the laser line, and along it the bead nearest to the picture's middle: the line that is
/// being scanned stands at the same place in every frame, its neighbours (and the pattern's border)
/// come and go at the picture's ends.
/// @param frames  upright (TurnUpright), some ten of one sweep, whole, all of one size.
[[nodiscard]] FoundCrop FindCrop(std::span<const Frame> frames, AxisDirection height_direction,
                                 vision::LaserLineWorkspace& workspace);

}  // namespace trammel::pressure_advance
