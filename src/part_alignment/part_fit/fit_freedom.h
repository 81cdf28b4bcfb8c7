// Motions of the ideal part that no measured point stops.
#pragma once

#include <string>

#include "part_alignment/part_fit/part_fit_problem.h"

namespace trammel::part_alignment {

/// Motions that change no stock allowance, in words; empty where there are none. On triangles: none
/// by more than their normals leave those of the smooth surface, so that a cylinder of facets is
/// as free as a round one. `linear` at the placement.
[[nodiscard]] std::string FreeMotions(const Problem& problem, const Linear& linear,
                                      const Motion& motion);

}  // namespace trammel::part_alignment
