// A second look at what no single shade tells from its surroundings: a disc half in a shadow, under
// a lamp's image, blurred, half covered, or hardly more than noise.
#pragma once

#include <optional>
#include <span>
#include <vector>

#include "base/page.h"
#include "part_alignment/targets/disc_fit.h"

namespace trammel::part_alignment {

/// A stretch of a row between two edges of shade.
struct Run {
  int row = 0;
  int first = 0;  ///< column of the edge
  int last = 0;
  bool dark = false;  ///< than what is beside it
};

struct RunRules {
  int min_px = 6;
  int max_px = 0;
  int edge_step = 0;  ///< least |I(x + 1) - I(x - 1)| of an edge
};

/// Memory of RunsOfRow, to be used again for the next row.
struct RowMemory {
  struct Edge {
    int column = 0;
    int step = 0;  ///< I(x + 1) - I(x - 1), grey levels
  };
  std::vector<Edge> edges;
  std::vector<Run> runs;
};

/// The runs of `row` with a length in [min_px, max_px] whose next edges are as far off as beyond a
/// disc's gap. An edge between two that are much steeper counts for none. A run that is darker than
/// one side and brighter than the other, as of a disc with a shadow's edge on it, comes as both.
/// They lie in `memory`. REQUIRES 1 channel.
std::span<const Run> RunsOfRow(const PageView& picture, int row, const RunRules& rules,
                               RowMemory& memory);

struct DiscByRaysRules {
  double noise = 0;  ///< of the picture's pixels, grey levels
  double min_radius_px = 3;
  double max_radius_px = 150;
};

/// The ellipse that the first steps of shade outwards, along rays from the middle of a run, lie on:
/// of half of the rays at least, so that light may differ from side to side and a part be covered.
/// Its contrast has the sign of the disc's and no size; blur and background are not set. Absent
/// where there is no such ellipse.
[[nodiscard]] std::optional<DiscModel> FindDiscByRays(const PageView& picture, const Run& run,
                                                      const DiscByRaysRules& rules);

}  // namespace trammel::part_alignment
