// The best pose for a set of observations, from nothing.
#pragma once

#include <optional>
#include <vector>

#include "part_alignment/pose/descend.h"

namespace trammel::part_alignment {

struct Fit {
  bool found = false;  ///< a pose with all targets in front of the camera
  bool converged = false;
  Theta theta;
  double chi_square = 0;
  int steps = 0;
  std::optional<Theta> other;  ///< another pose that fits within the bound, elsewhere
};

/// The most that chi-square reaches but for 1 in 10,000 (and the least, likewise).
[[nodiscard]] double ChiSquareHigh(int degrees_of_freedom);
[[nodiscard]] double ChiSquareLow(int degrees_of_freedom);
[[nodiscard]] int DegreesOfFreedom(const PoseProblem& problem);

/// Whether the observations tell every unknown at all (observability.h).
[[nodiscard]] bool FullRank(const PoseProblem& problem, const Theta& theta);

/// One descent from a guess, in the guess's middle frame: pose and clamp angle first, then the
/// rest. Its chi_square is JointChiSquare.
[[nodiscard]] Descent Refine(const PoseProblem& problem, const Theta& guess, SolveMethod method);

/// The best of the descents from FirstGuesses at the clamp angles given.
[[nodiscard]] Fit FitFrom(const PoseProblem& problem, SolveMethod method,
                          const std::vector<double>& clamp_angles_rad);

/// FitFrom clamp angle 0, and from all around where nothing fits there.
[[nodiscard]] Fit SolveWithoutInitialGuess(const PoseProblem& problem, SolveMethod method);

}  // namespace trammel::part_alignment
