// Solves the same plan over and over: for Monte Carlo and for machines in a hurry.
#pragma once

#include <span>

#include "base/result.h"
#include "part_alignment/pose/descend.h"

namespace trammel::part_alignment {

/// One plan (views, targets, sigmas), prepared once near a state; then pixels in, pose out without
/// an allocation. No outlier search and no verdict: Solve does those.
class PoseSolver {
 public:
  /// Of the options unknowns and what is uncertain count, as in Solve. The errors are those of
  /// Solve.
  [[nodiscard]] static Result<PoseSolver> Make(const Measurement& measurement,
                                               const SolveOptions& options,
                                               const geometry::Pose& machine_from_part,
                                               const Clamping& clamping);

  /// The observations in the order of views and observations; REQUIRES one pixel for each.
  /// theta as in Alignment::parameters; chi_square infinite where a target is not seen.
  [[nodiscard]] Descent SolvePixels(std::span<const Eigen::Vector2d> pixels);

  [[nodiscard]] const PoseProblem& problem() const { return own_; }
  /// Of the state it was made near.
  [[nodiscard]] const Theta& state() const { return state_; }

 private:
  PoseSolver() = default;

  /// From the pose by weights to the one beside which the inputs' errors are the likeliest.
  void AddErrorsOfInputs(std::span<const Eigen::Vector2d> pixels, Theta& theta) const;

  PoseProblem own_;     // in the part's frame
  PoseProblem middle_;  // the same in its middle frame
  MiddleFrame frame_;
  Theta state_;
  Theta middle_state_;
  Eigen::MatrixXd gain_;  // JointFit's
};

}  // namespace trammel::part_alignment
