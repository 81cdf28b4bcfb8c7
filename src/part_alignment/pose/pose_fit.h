// Fits a pose to observations: from a first guess by lines of sight, by damped Gauss-Newton.
#pragma once

#include <optional>
#include <span>
#include <vector>

#include "base/result.h"
#include "part_alignment/network/descent.h"
#include "part_alignment/pose/pose_problem.h"

namespace trammel::part_alignment {

struct Descent {
  Theta theta;
  double chi_square = 0;  ///< sum of squared residuals in sigmas
  int steps = 0;
  bool converged = false;
};

/// Descends from `start` by equations 10-13 of Mendikute et al. with weights. A step that loses
/// sight of a target or fits worse is repeated with Levenberg's damping. Converged: the next step
/// would move no projected place by more than 1e-8 sigma. Never allocates. chi_square is infinite
/// if the start does not see a target.
/// @param loss  reduces the pull of wrong targets; chi_square is then its cost
[[nodiscard]] Descent Descend(const PoseProblem& problem, const Theta& start,
                              const CauchyLoss& loss = {});

/// Finds poses (theta of the problem, clamping centred) that bring the targets near their lines of
/// sight and in front of the camera, best first, at most `most`.
///
/// For a clamp angle the sum of squared distances of targets from lines is quadratic in the
/// rotation matrix once the translation is eliminated (as for generalised cameras, Schweighofer &
/// Pinz 2008). It is descended on the rotations from 48 starts all over them. Empty: no rotation
/// brings the targets to the visible side. REQUIRES at least one observation.
[[nodiscard]] std::vector<Theta> FirstGuesses(const PoseProblem& problem, double clamp_angle_rad,
                                              std::size_t most);

struct Fit {
  bool found = false;  ///< a pose with all targets in front of the camera
  bool converged = false;
  Theta theta;
  double chi_square = 0;
  int steps = 0;
  std::optional<Theta> other;  ///< another pose that fits within the bound, elsewhere
};

/// Quantiles of chi-square: exceeded (fallen below, likewise) in 1 of 10,000.
[[nodiscard]] double ChiSquareHigh(int degrees_of_freedom);
[[nodiscard]] double ChiSquareLow(int degrees_of_freedom);
[[nodiscard]] int DegreesOfFreedom(const PoseProblem& problem);

/// True if the observations determine every unknown (observability.h).
[[nodiscard]] bool FullRank(const PoseProblem& problem, const Theta& theta);

/// Descends once from a guess, in the guess's middle frame: pose and clamp angle first, then the
/// rest. Its chi_square is JointChiSquare.
[[nodiscard]] Descent Refine(const PoseProblem& problem, const Theta& guess);

/// Returns the best of the descents from FirstGuesses at the clamp angles given.
[[nodiscard]] Fit FitFrom(const PoseProblem& problem, const std::vector<double>& clamp_angles_rad);

/// Fits from clamp angle 0, and from all around if nothing fits there.
[[nodiscard]] Fit SolveWithoutInitialGuess(const PoseProblem& problem);

/// Solver for one plan (views, targets, sigmas), prepared once near a state. Converts pixels to a
/// pose without an allocation. Does no outlier search and has no verdict: Solve does.
class PoseSolver {
 public:
  /// Makes a solver; of the options, unknowns and uncertainties count, as in Solve. The errors are
  /// those of Solve.
  [[nodiscard]] static Result<PoseSolver> Make(const Measurement& measurement,
                                               const SolveOptions& options,
                                               const geometry::Pose& machine_from_part,
                                               const Clamping& clamping);

  /// Solves for the pixels in the order of views and observations. REQUIRES one pixel for each
  /// observation. theta as in Alignment::parameters; chi_square infinite if a target is not
  /// visible.
  [[nodiscard]] Descent SolvePixels(std::span<const Eigen::Vector2d> pixels);

  [[nodiscard]] const PoseProblem& problem() const { return own_; }
  /// State near which the solver was made.
  [[nodiscard]] const Theta& state() const { return state_; }

 private:
  PoseSolver() = default;

  /// Moves theta from the weighted pose to that of the likeliest input errors.
  void AddErrorsOfInputs(std::span<const Eigen::Vector2d> pixels, Theta& theta) const;

  PoseProblem own_;     // part frame
  PoseProblem middle_;  // the same in its middle frame
  MiddleFrame frame_;
  Theta state_;
  Theta middle_state_;
  Eigen::MatrixXd gain_;  // JointFit's
};

}  // namespace trammel::part_alignment
