// The views that would tell what the present ones cannot.
#pragma once

#include <string>
#include <vector>

#include "part_alignment/pose/pose_problem.h"

namespace trammel::part_alignment {

/// Up to four views, each the one that improves the weakest direction most, until it is known
/// within `limit_mm`; at the distances used so far, in the orientations used so far and, for what
/// needs it, turned about the spindle's axis or farther away. In words, with spindle positions.
/// @param theta  where the observations' solution stands, however little they determine it.
[[nodiscard]] std::string AdviseViews(const PoseProblem& problem, const Theta& theta,
                                      const std::vector<PartTarget>& targets, double limit_mm);

}  // namespace trammel::part_alignment
