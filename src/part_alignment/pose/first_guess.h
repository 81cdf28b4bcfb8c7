// Where a part may be, found from lines of sight alone: no guess by the user.
#pragma once

#include <vector>

#include "part_alignment/pose/pose_problem.h"

namespace trammel::part_alignment {

/// Poses (theta of the problem, clamping centred) that bring the targets near their lines of sight
/// and in front of the camera, best first, at most `most`.
///
/// For a clamp angle the sum of squared distances of targets from lines is quadratic in the
/// rotation matrix once the translation is eliminated (as for generalised cameras, Schweighofer &
/// Pinz 2008); it is descended on the rotations from 48 starts all over them. Empty: no rotation
/// brings the targets to the visible side. REQUIRES at least one observation.
[[nodiscard]] std::vector<Theta> FirstGuesses(const PoseProblem& problem, double clamp_angle_rad,
                                              std::size_t most);

}  // namespace trammel::part_alignment
