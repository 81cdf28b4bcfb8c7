// What a mesh leaves in doubt of a placement.
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

}  // namespace trammel::part_alignment
