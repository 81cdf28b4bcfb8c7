// The same problem by Ceres: the default, and the one with a robust loss.
#pragma once

#include <vector>

#include "part_alignment/pose/descend.h"

namespace trammel::part_alignment {

/// Levenberg-Marquardt with the analytic derivatives. `loss_sigma` > 0: Cauchy's loss of that
/// width, so that a wrong target pulls ever less the farther off it is; 0: plain squares.
/// chi_square is that of the plain squares.
[[nodiscard]] Descent DescendByCeres(const PoseProblem& problem, const Theta& start,
                                     double loss_sigma);

}  // namespace trammel::part_alignment
