// Stretches of a picture's row that may be chords of discs.
#pragma once

#include <cstdint>
#include <vector>

#include "base/page.h"

namespace trammel::part_alignment {

/// A stretch of a row between two edges of opposite sign, with some contrast on both sides.
struct Run {
  int row = 0;
  int first = 0;  ///< column of the edge
  int last = 0;
  int inside = 0;   ///< grey level
  int outside = 0;  ///< the mean of both sides
  int nearer = 0;   ///< the side that is nearer to the inside
};

/// Calls `visit` for each run of `row` with a length in [min_px, max_px]. `edges` is memory.
/// REQUIRES 1 channel and a width of at least 16.
struct RunRules {
  int min_px = 0;
  int max_px = 0;
  int min_contrast = 0;
  int edge_step = 0;  ///< least |I(x + 1) - I(x - 1)| of an edge
};
void RunsOfRow(const PageView& picture, int row, const RunRules& rules,
               std::vector<std::int32_t>& edges, std::vector<Run>& runs);

}  // namespace trammel::part_alignment
