// A second look at what no single shade tells from its surroundings: a disc half in a shadow, under
// a lamp's image, blurred, half covered, or hardly more than noise.
#pragma once

#include <optional>

#include "base/page.h"
#include "part_alignment/targets/disc_fit.h"
#include "part_alignment/targets/row_runs.h"

namespace trammel::part_alignment {

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
