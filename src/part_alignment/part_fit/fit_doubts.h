// Finds other placements of the ideal part that the points allow: by meshes, and by surfaces.
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

/// Finds points off the mesh, other placements of equal fit, and points beyond a rim.
/// @param others  further placements that a search found
[[nodiscard]] MeshDoubt DoubtOf(const PartFitInput& input, const PartFitOptions& options,
                                const Problem& problem, const Motion& motion,
                                const std::vector<FoundPlacement>& others);

/// Explains why contacts at the rim of an open shell are unusable; empty if there are none.
[[nodiscard]] std::string BeyondRim(const PartFitInput& input, const Problem& problem,
                                    const Linear& linear);

/// Factor on the triangles' estimated error, added to the minimum stock allowance: triangles of
/// freeform parts were off by up to 1.56 times the estimate.
inline constexpr double kFacetGuard = 1.75;

struct FacetGuard {
  double error_mm = 0;  ///< the most to either side, under any point
  std::string coarse;   ///< why the facets are too coarse; empty if not
  std::string notice;
};

/// Adds the possible error of the triangles nearest to points to the points' guard and sigma, once.
[[nodiscard]] FacetGuard GuardFacets(Problem& problem, const Linear& linear);

/// Explains why a plane, shaft or bore does not belong to its points: stock allowance less wanted
/// (root mean square) exceeds PartFitOptions::most_uneven_mm. Names the worst; empty if all may
/// belong.
[[nodiscard]] std::string NotOnSurfaces(const PartFitOptions& options, const Problem& problem,
                                        const Linear& linear);

/// Explains why a plane's direction does not point out of the part: every measured point of the
/// other surfaces is on its outer side. Empty if all planes have points behind them.
[[nodiscard]] std::string TurnedRound(const Problem& problem, const Motion& motion);

/// Explains why a point is an outlier of its surface. It is off the others by more than their
/// scatter, its own uncertainty, and twice the stock allowance, the range of dents and bumps. Names
/// the worst; empty if there is none. A wrong point taken for a dent moves the part.
[[nodiscard]] std::string WildPoint(const PartFitInput& input, const Problem& problem,
                                    const Motion& motion);

}  // namespace trammel::part_alignment
