#include "part_alignment/pose/pose_solver.h"

#include "base/check.h"
#include "part_alignment/pose/input_effect.h"
#include "part_alignment/pose/joint_fit.h"
#include "part_alignment/pose/solve_input.h"

namespace trammel::part_alignment {

Result<PoseSolver> PoseSolver::Make(const Measurement& measurement, const SolveOptions& options,
                                    const geometry::Pose& machine_from_part,
                                    const Clamping& clamping) {
  auto problem = MakeProblem(measurement, options);
  if (!problem) {
    return tl::unexpected(problem.error());
  }
  PoseSolver solver;
  solver.own_ = std::move(*problem);
  solver.state_ = ThetaOf(solver.own_, machine_from_part, clamping);
  if (!solver.state_.allFinite()) {
    return Fail("the pose or the clamping to begin at is not finite");
  }
  InflateSigmas(solver.state_, solver.own_);
  solver.gain_ = FitJointly(solver.own_, solver.state_).gain;
  solver.frame_ =
      MiddleFrameOf(solver.own_, geometry::RotationFromAngles(machine_from_part.angles_rad));
  solver.middle_ = InMiddleFrame(solver.own_, solver.frame_);
  solver.middle_state_ = ToMiddleFrame(solver.frame_, solver.state_);
  return solver;
}

// The gain changes with theta by as little as theta does against the distances.
void PoseSolver::AddErrorsOfInputs(std::span<const Eigen::Vector2d> pixels, Theta& theta) const {
  const Chain chain(own_, theta, false);
  const Theta found = theta;
  for (std::size_t i = 0; i < pixels.size() && gain_.size() > 0; ++i) {
    WeightedObservation observation = own_.observations[i];
    observation.pixel = pixels[i];
    Eigen::Vector2d residual_px;
    if (!chain.Residual(observation, residual_px)) {
      theta = found;
      return;
    }
    theta.noalias() += gain_.middleCols<2>(2 * static_cast<Eigen::Index>(i)) * residual_px;
  }
}

Descent PoseSolver::SolvePixels(std::span<const Eigen::Vector2d> pixels) {
  TRAMMEL_CHECK(pixels.size() == middle_.observations.size(), "{} pixels for {} observations",
                pixels.size(), middle_.observations.size());
  for (std::size_t i = 0; i < pixels.size(); ++i) {
    middle_.observations[i].pixel = pixels[i];
  }
  Descent descent = Descend(middle_, middle_state_);
  descent.theta = FromMiddleFrame(frame_, descent.theta);
  AddErrorsOfInputs(pixels, descent.theta);
  return descent;
}

}  // namespace trammel::part_alignment
