// What the lines of sight can tell, and in which direction they tell least.
#pragma once

#include "part_alignment/pose/pose_problem.h"

namespace trammel::part_alignment {

/// What each unknown has to change by to move the targets by about 1 mm (mm or rad per mm), at
/// theta in the middle frame.
[[nodiscard]] Theta UnitsPerMillimetre(const PoseProblem& middle_problem, const Theta& theta);

/// Directions that are known worse than this (k = 1) count as not seen at all.
constexpr double kUnseen_mm = 100;

/// Rank and weakest direction by the singular values of the Jacobian with scaled columns: a
/// singular value is one over the standard uncertainty along its direction. `words` are left empty
/// where the weakest direction is known better than `limit_mm`. advice stays empty.
/// @param middle_problem in its middle frame, at theta. REQUIRES that all targets are seen.
[[nodiscard]] Observability Observe(const PoseProblem& middle_problem, const Theta& theta,
                                    double limit_mm);

}  // namespace trammel::part_alignment
