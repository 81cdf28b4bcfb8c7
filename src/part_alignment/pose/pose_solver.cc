#include "part_alignment/pose/pose_solver.h"

#include "base/check.h"
#include "part_alignment/pose/input_effect.h"
#include "part_alignment/pose/solve_input.h"

namespace trammel::part_alignment {

Result<PoseSolver> PoseSolver::Make(const Measurement& measurement, const SolveOptions& options,
                                    const geometry::Pose& machine_from_part,
                                    const Clamping& clamping) {
  if (const auto valid = ValidateInputs(options); !valid) {
    return tl::unexpected(valid.error());
  }
  auto problem = MakeProblem(measurement, options.unknowns);
  if (!problem) {
    return tl::unexpected(problem.error());
  }
  PoseSolver solver;
  solver.own_ = std::move(*problem);
  solver.state_ = ThetaOf(solver.own_, machine_from_part, clamping);
  if (!solver.state_.allFinite()) {
    return Fail("the pose or the clamping to begin at is not finite");
  }
  WidenSigmas(solver.state_, options.inputs, solver.own_);
  solver.frame_ =
      MiddleFrameOf(solver.own_, geometry::RotationFromAngles(machine_from_part.angles_rad));
  solver.middle_ = InMiddleFrame(solver.own_, solver.frame_);
  solver.middle_state_ = ToMiddleFrame(solver.frame_, solver.state_);
  return solver;
}

Descent PoseSolver::SolvePixels(std::span<const Eigen::Vector2d> pixels) {
  TRAMMEL_CHECK(pixels.size() == middle_.sights.size(), "{} pixels for {} sights", pixels.size(),
                middle_.sights.size());
  for (std::size_t i = 0; i < pixels.size(); ++i) {
    middle_.sights[i].pixel = pixels[i];
  }
  Descent descent = Descend(middle_, middle_state_);
  descent.theta = FromMiddleFrame(frame_, descent.theta);
  return descent;
}

}  // namespace trammel::part_alignment
