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

/// Why a plane's direction does not show out of the part: every measured point of the other
/// surfaces lies on its outer side. Empty where all planes have points behind them.
[[nodiscard]] std::string TurnedRound(const Problem& problem, const Motion& motion);

/// Why a point is not of its surface: beside the others of it by more than they scatter, by more
/// than it knows of itself, and by more than twice the stock allowance, in which dents and bumps
/// are.
/// Names the worst; empty where none is. A wrong point that is taken for a dent moves the part.
[[nodiscard]] std::string WildPoint(const PartFitInput& input, const Problem& problem,
                                    const Motion& motion);

}  // namespace trammel::part_alignment
