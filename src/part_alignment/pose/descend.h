// Gauss-Newton, damped only where a plain step does not help.
#pragma once

#include "part_alignment/pose/pose_problem.h"

namespace trammel::part_alignment {

struct Descent {
  Theta theta;
  double chi_square = 0;  ///< sum of squared residuals in sigmas
  int steps = 0;
  bool converged = false;
};

/// Equations 10-13 of Mendikute et al. with weights, from `start`. A step that sees a target no
/// more or fits worse is taken again with Levenberg's damping. Converged: the next step would move
/// no projected place by more than 1e-8 sigma. Never allocates. chi_square is infinite where
/// already the start does not see a target.
[[nodiscard]] Descent Descend(const PoseProblem& problem, const Theta& start, int most_steps = 60);

}  // namespace trammel::part_alignment
