// Least squares of a part fit alone: from a rough start to where the surfaces are.
#pragma once

#include "part_alignment/part_fit/part_fit_problem.h"

namespace trammel::part_alignment {

/// Towards what is wanted, damped, without regard to the least stock allowance. On triangles, whose
/// normals jump, until a round gains next to nothing.
[[nodiscard]] Motion FitSurfaces(const Problem& problem, Motion motion, int most_rounds = 240);

}  // namespace trammel::part_alignment
