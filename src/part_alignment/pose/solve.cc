#include "part_alignment/pose/solve.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "part_alignment/pose/input_effect.h"
#include "part_alignment/pose/observability.h"
#include "part_alignment/pose/solve_input.h"
#include "part_alignment/pose/view_advice.h"
#include "part_alignment/pose/wrong_sights.h"

namespace trammel::part_alignment {
namespace {

using Eigen::Vector2d;

/// The residuals of all sights; those left out have weight 0.
void FillResiduals(const PoseProblem& problem, const Theta& theta,
                   const std::vector<std::size_t>& left_out, const std::vector<std::string>& labels,
                   Alignment& alignment) {
  const Chain chain(problem, theta, false);
  for (std::size_t i = 0; i < problem.sights.size(); ++i) {
    const Sight& sight = problem.sights[i];
    Vector2d residual_px = Vector2d::Zero();
    const bool seen = chain.Residual(sight, residual_px);
    const bool wrong = std::find(left_out.begin(), left_out.end(), i) != left_out.end();
    if (!seen) {
      alignment.notices.push_back(
          fmt::format("target {} in view {} cannot be projected: it would lie behind the camera",
                      labels[sight.target], sight.view + 1));
    }
    alignment.residuals.push_back({sight.view, labels[sight.target], residual_px.x(),
                                   residual_px.y(), sight.sigma_px, wrong ? 0.0 : 1.0});
  }
}

void FillValues(const PoseProblem& problem, const Theta& theta, Alignment& alignment) {
  const Layout layout = LayoutOf(problem.unknowns);
  alignment.machine_from_part = PoseOf(theta);
  alignment.clamping = ClampingOf(layout, theta);
  alignment.focal_length_mm =
      layout.focal_length >= 0 ? theta[layout.focal_length] : problem.camera.focal_length_mm;
  alignment.camera_offset_mm = problem.camera.taper_from_camera.translation_mm;
  if (layout.camera_offset >= 0) {
    alignment.camera_offset_mm = theta.segment<3>(layout.camera_offset);
  }
}

void FillChiSquare(const PoseProblem& problem, const Fit& fit, Alignment& alignment) {
  const int freedom = std::max(0, DegreesOfFreedom(problem));
  alignment.chi_square = fit.chi_square;
  alignment.degrees_of_freedom = freedom;
  alignment.chi_square_low = ChiSquareLow(freedom);
  alignment.chi_square_high = ChiSquareHigh(freedom);
  alignment.residual_rms_sigma = freedom > 0 ? std::sqrt(fit.chi_square / freedom) : 0;
  if (freedom == 0) {
    alignment.notices.push_back(
        "no more measured numbers than unknowns: nothing checks the answer, add a view");
  } else if (fit.chi_square < alignment.chi_square_low) {
    alignment.notices.push_back(fmt::format(
        "the residuals are smaller than their sigmas allow (chi-square {:.3g}, at least {:.3g} "
        "expected with {} degrees of freedom): the stated sigmas are too large",
        fit.chi_square, alignment.chi_square_low, freedom));
  }
}

std::string TooLarge(const Alignment& alignment) {
  const auto worst = std::max_element(alignment.residuals.begin(), alignment.residuals.end(),
                                      [](const auto& a, const auto& b) {
                                        return std::hypot(a.column_px, a.row_px) / a.sigma_px <
                                               std::hypot(b.column_px, b.row_px) / b.sigma_px;
                                      });
  return fmt::format(
      "the residuals contradict their sigmas: chi-square {:.4g} with {} degrees of freedom, at "
      "most "
      "{:.4g} expected; largest at target {} in view {}: ({:.3g}, {:.3g}) px",
      alignment.chi_square, alignment.degrees_of_freedom, alignment.chi_square_high, worst->target,
      worst->view + 1, worst->column_px, worst->row_px);
}

Alignment Refuse(Alignment alignment, Verdict verdict, std::string reason) {
  alignment.verdict = verdict;
  alignment.reason = std::move(reason);
  return alignment;
}

/// Observability, and what else can keep a fit from being an answer.
Alignment Judge(const PoseProblem& problem, const Fit& fit, const std::vector<PartTarget>& targets,
                const SolveOptions& options, Alignment alignment) {
  constexpr double kGimbalLock = 1e-6;
  const MiddleFrame frame =
      MiddleFrameOf(problem, geometry::RotationFromAngles(fit.theta.segment<3>(3)));
  alignment.observability = Observe(InMiddleFrame(problem, frame), ToMiddleFrame(frame, fit.theta),
                                    options.weakest_limit_mm);
  if (!alignment.observability.words.empty()) {
    alignment.observability.advice =
        AdviseViews(problem, fit.theta, targets, options.weakest_limit_mm);
    return Refuse(std::move(alignment), Verdict::kCannotTell, alignment.observability.words);
  }
  if (fit.other) {
    const Eigen::Vector3d other_mm = fit.other->head<3>();
    return Refuse(std::move(alignment), Verdict::kCannotTell,
                  fmt::format("two poses fit the observations (the other at X {:.3f} Y {:.3f} Z "
                              "{:.3f}): add a view of another target",
                              other_mm.x(), other_mm.y(), other_mm.z()));
  }
  if (std::abs(std::cos(fit.theta[4])) < kGimbalLock) {
    return Refuse(std::move(alignment), Verdict::kCannotTell,
                  "the part is turned by 90 degrees about Y, where alpha and gamma are one angle: "
                  "give the ideal part another frame");
  }
  if (!fit.converged) {
    return Refuse(std::move(alignment), Verdict::kRefused,
                  fmt::format("the solution did not settle within {} steps", fit.steps));
  }
  alignment.covariance =
      CovarianceByInputs(problem, fit.theta, options.inputs, options.camera_covariance);
  if (alignment.covariance.size() == 0) {
    return Refuse(std::move(alignment), Verdict::kCannotTell,
                  "the ideal part's frame lies so far from its targets that its place and its "
                  "angles cannot be told apart: give it an origin nearer to them");
  }
  alignment.verdict = Verdict::kGood;
  return alignment;
}

/// A camera held out in front of its taper cannot look back at it; its file may mean the other
/// side.
void NoticeLookingBack(const Camera& camera, Alignment& alignment) {
  constexpr double kHeldOut_mm = 20;
  constexpr double kBackwards = -0.5;  // 120 degrees and more
  const Eigen::Vector3d out_mm = camera.taper_from_camera.translation_mm;
  const double side = camera.looks_along == LooksAlong::kPlusZ ? 1 : -1;
  const Eigen::Vector3d view =
      side * geometry::RotationFromAngles(camera.taper_from_camera.angles_rad).col(2);
  if (out_mm.norm() < kHeldOut_mm || view.dot(out_mm) > kBackwards * out_mm.norm()) return;
  alignment.notices.push_back(
      "by its file the camera looks back at the spindle that holds it: check looks_along and the "
      "angles of taper_from_camera");
}

/// By how much the worst of what was left out is off; nothing where none of it can be projected.
std::string FarthestOff(const std::vector<AlignmentResidual>& residuals,
                        const std::vector<std::size_t>& sights) {
  double farthest_px = 0;
  for (const std::size_t i : sights) {
    farthest_px = std::max(farthest_px, std::hypot(residuals[i].column_px, residuals[i].row_px));
  }
  return farthest_px > 0 ? fmt::format(", {:.3g} px beside where the others put it", farthest_px)
                         : std::string();
}

Alignment Fill(const PoseProblem& all, const PoseProblem& kept, const Fit& fit,
               const std::vector<std::size_t>& left_out, const std::vector<std::string>& labels) {
  Alignment alignment;
  alignment.parameters = ParameterNames(all.unknowns);
  alignment.iterations = fit.steps;
  NoticeLookingBack(all.camera, alignment);
  FillValues(all, fit.theta, alignment);
  FillResiduals(all, fit.theta, left_out, labels, alignment);
  FillChiSquare(kept, fit, alignment);
  return alignment;
}

}  // namespace

Result<Alignment> Solve(const Measurement& measurement, const SolveOptions& options) {
  if (!(options.weakest_limit_mm >= 1e-3 && options.weakest_limit_mm <= 100)) {
    return Fail(fmt::format("weakest_limit_mm is {}, it must lie in 0.001 ... 100",
                            options.weakest_limit_mm));
  }
  if (const auto valid = ValidateInputs(options); !valid) {
    return tl::unexpected(valid.error());
  }
  auto problem = MakeProblem(measurement, options.unknowns);
  if (!problem) {
    return tl::unexpected(problem.error());
  }
  if (options.inputs.machine_mm > 0 || options.inputs.target_mm > 0 || options.camera_covariance) {
    // What a millimetre is worth in pixels needs the distances: a rough solution has them.
    if (const Fit rough = FitFromNothing(*problem, SolveMethod::kGaussNewton); rough.found) {
      WidenSigmas(rough.theta, options.inputs, *problem);
      if (options.camera_covariance) {
        problem->shared = CameraMoves(*problem, rough.theta, *options.camera_covariance);
      }
    }
  }
  std::vector<std::string> labels;
  for (const PartTarget& target : measurement.targets) {
    labels.push_back(target.id);
  }
  const Fit fit = FitFromNothing(*problem, options.method);
  const bool fits = fit.found && fit.chi_square <= ChiSquareHigh(DegreesOfFreedom(*problem));
  if (fits || (fit.found && DegreesOfFreedom(*problem) <= 0)) {
    return Judge(*problem, fit, measurement.targets, options,
                 Fill(*problem, *problem, fit, {}, labels));
  }
  WrongSights wrong;
  if (options.robust) {
    wrong = FindWrongSights(*problem, fit, labels, options.method);
  }
  if (!wrong.sights.empty()) {
    const PoseProblem kept = Without(*problem, wrong.sights);
    Alignment alignment = Fill(*problem, kept, wrong.fit, wrong.sights, labels);
    alignment.notices.push_back(
        fmt::format("left out: {}{}", wrong.what, FarthestOff(alignment.residuals, wrong.sights)));
    alignment = Judge(kept, wrong.fit, measurement.targets, options, std::move(alignment));
    if (alignment.verdict != Verdict::kGood) {
      alignment.verdict = Verdict::kRefused;
      alignment.reason =
          fmt::format("{} is wrong, and without it: {}", wrong.what, alignment.reason);
    }
    return alignment;
  }
  if (!fit.found) {
    Alignment alignment;
    alignment.parameters = ParameterNames(options.unknowns);
    return Refuse(
        std::move(alignment), Verdict::kRefused,
        "no pose of the part brings all targets before the camera: check the targets' ids, "
        "the camera's looks_along and the views' positions");
  }
  Alignment alignment = Fill(*problem, *problem, fit, {}, labels);
  std::string reason = TooLarge(alignment);
  if (!wrong.doubt.empty()) {
    reason += "; " + wrong.doubt;
  }
  return Refuse(std::move(alignment), Verdict::kRefused, std::move(reason));
}

}  // namespace trammel::part_alignment
