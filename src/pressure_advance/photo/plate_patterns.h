// Patterns of corners on one plate, found in a photo by their places in the G-code.
#pragma once

#include <optional>
#include <span>
#include <string>
#include <vector>

#include "base/frame.h"
#include "vision/chevron_finder.h"

namespace trammel::pressure_advance {

/// Place of a pattern on the plate.
struct PlatePattern {
  int count = 0;          ///< of corners
  double spacing_mm = 0;  ///< of the apexes
  double x_mm = 0;        ///< middle, y pointing away from the operator
  double y_mm = 0;
  double heading_rad = 0;  ///< of the apexes, from +x counter-clockwise
};

struct PlateView {
  std::string problem;  ///< why the patterns are not known, and the remedy; empty if they are
  std::vector<std::optional<vision::FoundChevrons>> found;  ///< for each pattern; absent: not seen
};

/// Finds one pattern, supposes each of the plan's in its place, and looks for the others where they
/// should then be, the nearest first. The supposition with which most are seen counts.
/// Cost: about 0.4 s a pattern.
/// @param photo     at most 16384 px each way, not mirrored
/// @param patterns  at least 2
[[nodiscard]] PlateView FindPlatePatterns(const BgrView& photo,
                                          std::span<const PlatePattern> patterns);

}  // namespace trammel::pressure_advance
