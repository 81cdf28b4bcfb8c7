// Other places of the ideal part that the points allow: by meshes, and by surfaces.
#pragma once

#include <string>
#include <vector>

#include "base/measured.h"
#include "part_alignment/part_fit/fit_start.h"
#include "part_alignment/part_fit/part_fit_problem.h"

namespace trammel::part_alignment {

struct MeshDoubt {
  Verdict verdict = Verdict::kCannotTell;
  std::string reason;  ///< empty: there is none
};

/// Points that do not lie on the mesh, other placements that fit alike, points beyond a rim.
/// @param others  that a search found besides
[[nodiscard]] MeshDoubt DoubtOf(const PartFitInput& input, const PartFitOptions& options,
                                const Problem& problem, const Motion& motion,
                                const std::vector<FoundPlacement>& others);

/// Why contacts at the rim of an open shell cannot be used; empty where there are none.
[[nodiscard]] std::string BeyondRim(const PartFitInput& input, const Problem& problem,
                                    const Linear& linear);

/// So many times what triangles are estimated to be off joins the least stock allowance: triangles
/// of freeform parts were off by up to 1.56 times.
inline constexpr double kFacetGuard = 1.75;

struct FacetGuard {
  double error_mm = 0;  ///< the most to either side, under any point
  std::string coarse;   ///< why the answer is left open; empty where it is not
  std::string notice;
};

/// Adds what the triangles nearest to points may be off to the points' guard and sigma, once.
[[nodiscard]] FacetGuard GuardFacets(Problem& problem, const Linear& linear);

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
