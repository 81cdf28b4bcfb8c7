// Observability by the lines of sight, and the weakest direction.
#pragma once

#include "part_alignment/pose/pose_problem.h"

namespace trammel::part_alignment {

/// Returns the change of each unknown that moves the targets by about 1 mm (mm or rad per mm), at
/// theta in the middle frame.
[[nodiscard]] Theta UnitsPerMillimetre(const PoseProblem& middle_problem, const Theta& theta);

/// Uncertainty (k = 1) above which a direction counts as unobserved.
constexpr double kUnseen_mm = 100;

/// Computes rank and weakest direction by the singular values of the Jacobian with scaled columns:
/// a singular value is the inverse of the standard uncertainty along its direction. `words` is
/// empty if the weakest direction's uncertainty is below `limit_mm`; advice is always empty.
/// @param middle_problem in its middle frame, at theta. REQUIRES that all targets are visible.
[[nodiscard]] Observability Observe(const PoseProblem& middle_problem, const Theta& theta,
                                    double limit_mm);

}  // namespace trammel::part_alignment
