// Stretches of a picture's row that may be chords of discs.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "base/page.h"

namespace trammel::part_alignment {

/// A stretch of a row between two edges, darker or brighter than what is beside it.
struct Run {
  int row = 0;
  int first = 0;  ///< column of the edge
  int last = 0;
  bool dark = false;   ///< than what is beside it, by the steps of shade
  bool even = false;   ///< whether both sides differ from it alike; the levels are set only then
  bool apart = false;  ///< whether the next edges are as far off as beyond a disc's gap
  int inside = 0;      ///< grey level
  int outside = 0;     ///< the mean of both sides
  int nearer = 0;      ///< the side that is nearer to the inside
};

struct RunRules {
  int min_px = 0;
  int max_px = 0;
  int min_contrast = 0;
  int edge_step = 0;  ///< least |I(x + 1) - I(x - 1)| of an edge
  /// Whether I is blended across rows, (1, 2, 1)/4, so that less of its noise looks like edges.
  bool across_rows = false;
};

/// Memory of RunsOfRow, to be used again for the next row.
struct RowMemory {
  std::vector<std::uint8_t> line;
  std::vector<int> columns;  ///< of edges
  std::vector<int> steps;
  std::vector<std::uint8_t> kinds;  ///< of stretches between them
  std::vector<int> chosen;
  std::vector<Run> runs;
};

/// The runs of `row` with a length in [min_px, max_px] that are even or apart, between edges that
/// are next to each other; an edge between two that are much steeper counts for none. A run that is
/// darker than one side and brighter than the other, as of a disc with a shadow's edge on it, comes
/// as both. They lie in `memory`. REQUIRES 1 channel and a width of at least 16.
std::span<const Run> RunsOfRow(const PageView& picture, int row, const RunRules& rules,
                               RowMemory& memory);

}  // namespace trammel::part_alignment
