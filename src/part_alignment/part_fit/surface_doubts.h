// Whether points lie on the planes, shafts and bores that they are said to.
#pragma once

#include <string>

#include "part_alignment/part_fit/part_fit_problem.h"

namespace trammel::part_alignment {

/// Why a plane, shaft or bore is not its points' own: their stock allowance is farther from what is
/// wanted (root mean square) than PartFitOptions::most_uneven_mm. Names the worst; empty where all
/// may be theirs.
[[nodiscard]] std::string NotOnSurfaces(const PartFitOptions& options, const Problem& problem,
                                        const Linear& linear);

}  // namespace trammel::part_alignment
