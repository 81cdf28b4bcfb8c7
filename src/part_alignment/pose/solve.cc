#include "part_alignment/pose/solve.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>

#include "part_alignment/camera/calibration_record.h"
#include "part_alignment/pose/joint_fit.h"
#include "part_alignment/pose/observability.h"
#include "part_alignment/pose/outliers.h"
#include "part_alignment/pose/pose_fit.h"
#include "part_alignment/pose/pose_problem.h"
#include "part_alignment/pose/view_advice.h"

namespace trammel::part_alignment {
using Eigen::Vector2d;

namespace {

/// Fills in the residuals of all observations; excluded ones have weight 0.
/// @param common  estimates of clamping and camera beside the unknowns
void FillResiduals(const PoseProblem& problem, const Theta& theta, const Theta& common,
                   const std::vector<std::size_t>& left_out, const std::vector<std::string>& labels,
                   Alignment& alignment) {
  const Chain chain(WithEverything(problem), EverythingAt(problem, theta) + common, false);
  for (std::size_t i = 0; i < problem.observations.size(); ++i) {
    const WeightedObservation& observation = problem.observations[i];
    Vector2d residual_px = Vector2d::Zero();
    const bool seen = chain.Residual(observation, residual_px);
    const bool wrong = std::find(left_out.begin(), left_out.end(), i) != left_out.end();
    if (!seen) {
      alignment.notices.push_back(
          fmt::format("target {} in view {} cannot be projected: it would lie behind the camera",
                      labels[observation.target], observation.view + 1));
    }
    alignment.residuals.push_back({observation.view, labels[observation.target], residual_px.x(),
                                   residual_px.y(), observation.sigma_px, wrong ? 0.0 : 1.0});
  }
}

void FillValues(const PoseProblem& problem, const Theta& theta, Alignment& alignment) {
  const Camera camera = CameraOf(problem, theta);
  alignment.machine_from_part = PoseOf(theta);
  alignment.clamping = ClampingOf(LayoutOf(problem.unknowns), theta);
  alignment.focal_length_mm = camera.focal_length_mm;
  alignment.camera_offset_mm = camera.taper_from_camera.translation_mm;
}

/// @param stated  all that residuals show, none of it with a usual size
void FillChiSquare(const PoseProblem& problem, const Fit& fit, bool stated, Alignment& alignment) {
  const int freedom = std::max(0, DegreesOfFreedom(problem));
  alignment.chi_square = fit.chi_square;
  alignment.degrees_of_freedom = freedom;
  alignment.chi_square_low = ChiSquareLow(freedom);
  alignment.chi_square_high = ChiSquareHigh(freedom);
  alignment.residual_rms_sigma = freedom > 0 ? std::sqrt(fit.chi_square / freedom) : 0;
  if (freedom == 0) {
    alignment.notices.push_back(
        "no more measured numbers than unknowns: nothing checks the answer, add a view");
  } else if (stated && fit.chi_square < alignment.chi_square_low) {
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

/// Refuses an alignment, taken by reference: the text of the reason may be its own, and an argument
/// by value could be moved from before it is read.
Alignment Refuse(Alignment&& alignment, Verdict verdict, std::string reason) {
  Alignment refused = std::move(alignment);
  refused.verdict = verdict;
  refused.reason = std::move(reason);
  return refused;
}

/// Weighs the observations by pixels and machine. A target's error is the same in all views: no
/// view shows it, and it only widens the result.
PoseProblem ByViews(PoseProblem problem, const Theta& theta) {
  problem.errors.targets.resize(0, 0);
  InflateSigmas(theta, problem);
  return problem;
}

bool TargetsStated(const SolveOptions& options) {
  return options.inputs.target_mm || options.target_covariance;
}

/// Reports that targets without stated errors are worse than usual. The verdict reports it if the
/// part's place is then less certain than the weakest direction may be.
Alignment JudgeTargets(const Measurement& measurement, const SolveOptions& options,
                       Alignment alignment) {
  constexpr double kMuchMore = 2;
  if (TargetsStated(options) || alignment.verdict != Verdict::kGood) return alignment;
  const double usual_mm = *CountedInputs(measurement, options).target_mm;
  const double counted_mm = *alignment.inputs.target_mm;
  if (counted_mm <= kMuchMore * usual_mm) return alignment;
  std::string words = fmt::format(
      "the residuals ask for targets that are off by {:.2g} mm per coordinate (k = 1), where "
      "{:.2g} mm is usual and nothing is stated of them: measure them on the part (align survey, "
      "align "
      "fit) or state target_mm",
      counted_mm, usual_mm);
  if (counted_mm > options.weakest_limit_mm) {
    return Refuse(std::move(alignment), Verdict::kCannotTell, std::move(words));
  }
  alignment.notices.push_back(std::move(words));
  return alignment;
}

/// Checks observability, and all else that can invalidate a fit.
Alignment Judge(const PoseProblem& problem, const Fit& fit, const Measurement& measurement,
                const SolveOptions& options, Alignment alignment) {
  constexpr double kGimbalLock = 1e-6;
  const MiddleFrame frame =
      MiddleFrameOf(problem, geometry::RotationFromAngles(fit.theta.segment<3>(3)));
  const PoseProblem views = ByViews(problem, fit.theta);
  alignment.observability = Observe(InMiddleFrame(views, frame), ToMiddleFrame(frame, fit.theta),
                                    options.weakest_limit_mm);
  if (!alignment.observability.words.empty()) {
    alignment.observability.advice =
        AdviseViews(views, fit.theta, measurement.targets, options.weakest_limit_mm);
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
  alignment.covariance = FitJointly(problem, fit.theta).covariance;
  if (alignment.covariance.size() == 0) {
    return Refuse(std::move(alignment), Verdict::kCannotTell,
                  "the ideal part's frame lies so far from its targets that its place and its "
                  "angles cannot be told apart: give it an origin nearer to them");
  }
  alignment.verdict = Verdict::kGood;
  return JudgeTargets(measurement, options, std::move(alignment));
}

/// Explains why no camera in a spindle can match its file; empty: it can. No residual shows a
/// camera that looks the other way. Turned by half a turn in its clamping, it also sees a part
/// behind itself, twice its distance off.
std::string LooksBack(const Camera& camera) {
  constexpr double kHeldOut_mm = 20;
  constexpr double kBackwards = 0.5;  // within 60 degrees
  const Eigen::Vector3d out_mm = camera.taper_from_camera.translation_mm;
  const double side = camera.looks_along == LooksAlong::kPlusZ ? 1 : -1;
  const Eigen::Vector3d view =
      side * geometry::RotationFromAngles(camera.taper_from_camera.angles_rad).col(2);
  const bool at_taper =
      out_mm.norm() >= kHeldOut_mm && view.dot(out_mm) < -kBackwards * out_mm.norm();
  // The taper's z points into the spindle.
  if (!at_taper && view.z() < kBackwards) return {};
  return fmt::format(
      "by its file the camera looks back at the spindle that holds it (along {:.2f}, {:.2f}, "
      "{:.2f} "
      "of the taper, held out to {:.0f}, {:.0f}, {:.0f} mm; the taper's z shows into the spindle): "
      "check looks_along, and the signs of angles_rad and translation_mm of taper_from_camera",
      view.x(), view.y(), view.z(), out_mm.x(), out_mm.y(), out_mm.z());
}

/// Notices a reversed clamping: in pictures, two axes of the wrong sign look like a camera clamped
/// the other way round.
void NoticeTurnedClamping(Alignment& alignment) {
  constexpr double kTurned_rad = 0.5;
  const double turned_rad = alignment.clamping.angle_rad;
  if (std::abs(turned_rad) < kTurned_rad) return;
  alignment.notices.push_back(
      fmt::format("the camera is clamped {:.1f} degrees from where it was calibrated; see that it "
                  "is so: places of which two axes have the wrong sign look like half a turn",
                  turned_rad * 180 / std::numbers::pi));
}

/// Formats the worst residual of the excluded observations; empty if none of them projects.
std::string FarthestOff(const std::vector<AlignmentResidual>& residuals,
                        const std::vector<std::size_t>& observations) {
  double farthest_px = 0;
  for (const std::size_t i : observations) {
    farthest_px = std::max(farthest_px, std::hypot(residuals[i].column_px, residuals[i].row_px));
  }
  return farthest_px > 0 ? fmt::format(", {:.3g} px beside where the others put it", farthest_px)
                         : std::string();
}

/// Fit with the estimated errors of the inputs; `common` are those of clamping and camera.
struct SettledFit {
  Fit fit;
  Theta common;
};

SettledFit Settle(const PoseProblem& problem, Fit fit) {
  constexpr int kSteps = 2;  // linear but for some nanometres
  SettledFit settled{std::move(fit), Theta::Zero(LayoutOf(WithEverything(problem).unknowns).size)};
  if (!FullRank(problem, settled.fit.theta)) return settled;
  for (int i = 0; i < kSteps; ++i) {
    const JointFit joint = FitJointly(problem, settled.fit.theta);
    settled.common = joint.common;
    if (joint.step.size() == 0) break;
    settled.fit.theta += joint.step;
    settled.fit.chi_square = joint.chi_square;
  }
  return settled;
}

/// Problem with its solution, if there is one.
struct Answer {
  PoseProblem problem;      ///< all observations, with the errors in `inputs`
  InputUncertainty inputs;  ///< as used: unstated ones from the residuals
  std::vector<std::size_t> left_out;
  Fit fit;
  std::string what_is_wrong;  ///< description of left_out for users
  std::string doubt;
  bool fits = false;
};

bool Fits(const PoseProblem& problem, const Fit& fit) {
  const int freedom = DegreesOfFreedom(problem);
  return fit.found && (freedom <= 0 || fit.chi_square <= ChiSquareHigh(freedom));
}

/// Sets the errors of machine and targets, unless stated, to those that the residuals require, and
/// fits again.
/// @param share  as of TargetErrorByResiduals
Fit FitByResiduals(const Fit& fit, const SolveOptions& options, double share, PoseProblem& problem,
                   InputUncertainty& inputs) {
  if (!TargetsStated(options)) {
    const double usual_mm = *inputs.target_mm;
    inputs.target_mm = TargetErrorByResiduals(problem, fit.theta, usual_mm, share);
    problem.errors.targets *= *inputs.target_mm / usual_mm;
  }
  if (!options.inputs.machine_mm) {
    inputs.machine_mm = RepeatabilityByResiduals(problem, fit.theta, TargetsStated(options));
    problem.errors.machine_mm = *inputs.machine_mm;
  }
  InflateSigmas(fit.theta, problem);
  const Descent descent = Refine(problem, fit.theta);
  return {true, descent.converged, descent.theta, descent.chi_square, fit.steps, fit.other};
}

/// Probability of the chi-square quantile: one of five samples has less scatter.
constexpr double kOneInFive = 0.2;

/// Solves with all observations, if machine and targets may be worse than usual to make it fit.
Answer ByAllObservations(const Answer& usual, const SolveOptions& options) {
  if (!usual.fit.found || (options.inputs.machine_mm && TargetsStated(options))) return usual;
  Answer scattered = usual;
  scattered.fit =
      FitByResiduals(usual.fit, options, kOneInFive, scattered.problem, scattered.inputs);
  PoseProblem worst = scattered.problem;
  worst.errors.machine_mm = std::min(worst.errors.machine_mm, kWorstRepeatability_mm);
  Fit judged = scattered.fit;
  judged.chi_square = JointChiSquare(worst, judged.theta);
  scattered.fits = Fits(worst, judged);
  if (!scattered.fits) return usual;
  if (!usual.fits) {  // larger errors may also permit a fit elsewhere
    scattered.fit.other = SolveWithoutInitialGuess(scattered.problem).other;
  }
  return scattered;
}

Answer WithoutWrong(const Answer& usual, const Outliers& wrong, const SolveOptions& options) {
  Answer answer{usual.problem, usual.inputs, wrong.observations, wrong.fit, wrong.what, {}, true};
  PoseProblem kept = Without(usual.problem, wrong.observations);
  // The best of as many remainders as there are targets scatters less than a single one.
  const double share =
      kOneInFive / static_cast<double>(std::max<Eigen::Index>(1, kept.errors.targets.rows() / 3));
  answer.fit = FitByResiduals(wrong.fit, options, share, kept, answer.inputs);
  answer.problem.errors = kept.errors;
  InflateSigmas(answer.fit.theta, answer.problem);
  return answer;
}

/// Fits the pose without a guess, and computes the effect of a millimetre of machine and targets in
/// pixels.
Fit FirstFit(const SolveOptions& options, PoseProblem& problem) {
  // A machine without stated repeatability may be as bad as machines are.
  PoseProblem rough = problem;
  if (!options.inputs.machine_mm) rough.errors.machine_mm = kWorstRepeatability_mm;
  const Fit fit = SolveWithoutInitialGuess(rough);
  if (fit.found) InflateSigmas(fit.theta, problem);
  if (!Fits(rough, fit)) return SolveWithoutInitialGuess(problem);
  const Descent descent = Refine(problem, fit.theta);
  return {true,     descent.converged, descent.theta, descent.chi_square, fit.steps + descent.steps,
          fit.other};
}

Answer FindAnswer(PoseProblem problem, const InputUncertainty& inputs,
                  const std::vector<std::string>& labels, const SolveOptions& options) {
  // Excluding an observation explains residuals better than large errors of machine or targets, if
  // the rest shows that they are three times as good.
  constexpr double kBetter = 3;
  const Fit fit = FirstFit(options, problem);
  const Answer usual{problem, inputs, {}, fit, {}, {}, Fits(problem, fit)};
  Answer all = ByAllObservations(usual, options);
  if (usual.fits || !options.robust) return all;
  const Outliers wrong = FindOutliers(problem, fit, labels);
  all.doubt = wrong.doubt;
  if (wrong.observations.empty()) return all;
  Answer rest = WithoutWrong(usual, wrong, options);
  const bool better = kBetter * *rest.inputs.machine_mm < *all.inputs.machine_mm ||
                      kBetter * *rest.inputs.target_mm < *all.inputs.target_mm;
  return all.fits && !better ? all : rest;
}

/// Lists the inputs that count with their usual size.
std::vector<std::string> UsualInputs(const SolveOptions& options) {
  std::vector<std::string> usual;
  const InputUncertainty& inputs = options.inputs;
  if (!inputs.machine_mm) usual.emplace_back("machine_mm");
  if (!TargetsStated(options)) usual.emplace_back("target_mm");
  if (!inputs.clamp_eccentricity_mm && !options.unknowns.clamp_eccentricity) {
    usual.emplace_back("clamp_eccentricity_mm");
  }
  if (!inputs.camera_offset_mm && !options.unknowns.camera_offset && !options.camera_covariance) {
    usual.emplace_back("camera_offset_mm");
  }
  return usual;
}

Alignment Fill(const Answer& answer, const SettledFit& settled, const SolveOptions& options,
               const std::vector<std::string>& labels) {
  const PoseProblem& all = answer.problem;
  Alignment alignment;
  alignment.parameters = ParameterNames(all.unknowns);
  alignment.iterations = settled.fit.steps;
  alignment.inputs = answer.inputs;
  alignment.usual_inputs = UsualInputs(options);
  FillValues(all, settled.fit.theta, alignment);
  NoticeTurnedClamping(alignment);
  FillResiduals(all, settled.fit.theta, settled.common, answer.left_out, labels, alignment);
  FillChiSquare(Without(all, answer.left_out), settled.fit,
                options.inputs.machine_mm && TargetsStated(options), alignment);
  RejectionTally tally;
  for (const AlignmentResidual& residual : alignment.residuals) {
    tally.Add({fmt::format("view {}", residual.view + 1), "target " + residual.target},
              residual.weight == 0);
  }
  alignment.check = tally.Check(alignment.degrees_of_freedom);
  return alignment;
}

std::vector<std::string> LabelsOf(const std::vector<PartTarget>& targets) {
  std::vector<std::string> labels;
  for (const PartTarget& target : targets) labels.push_back(target.id);
  return labels;
}

}  // namespace

Result<Alignment> Solve(const Measurement& measurement, const SolveOptions& options) {
  if (!(options.weakest_limit_mm >= 1e-3 && options.weakest_limit_mm <= 100)) {
    return Fail(fmt::format("weakest_limit_mm is {}, it must lie in 0.001 ... 100",
                            options.weakest_limit_mm));
  }
  auto problem = TRY(MakeProblem(measurement, options));
  if (std::string back = LooksBack(measurement.camera); !back.empty()) {
    Alignment alignment;
    alignment.parameters = ParameterNames(options.unknowns);
    return Refuse(std::move(alignment), Verdict::kRefused, std::move(back));
  }
  const std::vector<std::string> labels = LabelsOf(measurement.targets);
  const Answer answer =
      FindAnswer(std::move(problem), CountedInputs(measurement, options), labels, options);
  if (!answer.fit.found) {
    Alignment alignment;
    alignment.parameters = ParameterNames(options.unknowns);
    return Refuse(
        std::move(alignment), Verdict::kRefused,
        "no pose of the part brings all targets before the camera: check the targets' ids, "
        "the camera's looks_along and the views' positions");
  }
  const PoseProblem kept = Without(answer.problem, answer.left_out);
  const SettledFit settled = Settle(kept, answer.fit);
  Alignment alignment = Fill(answer, settled, options, labels);
  if (!answer.fits) {
    std::string reason = TooLarge(alignment);
    if (!answer.doubt.empty()) reason += "; " + answer.doubt;
    return Refuse(std::move(alignment), Verdict::kRefused, std::move(reason));
  }
  if (answer.left_out.empty()) {
    return Judge(kept, settled.fit, measurement, options, std::move(alignment));
  }
  alignment.notices.push_back(fmt::format("left out: {}{}", answer.what_is_wrong,
                                          FarthestOff(alignment.residuals, answer.left_out)));
  if (!alignment.check.contradiction.empty()) {
    return Refuse(
        std::move(alignment), Verdict::kCannotTell,
        fmt::format("{}; left out were {}", alignment.check.contradiction, answer.what_is_wrong));
  }
  alignment = Judge(kept, settled.fit, measurement, options, std::move(alignment));
  if (alignment.verdict != Verdict::kGood) {
    alignment.verdict = Verdict::kRefused;
    alignment.reason =
        fmt::format("{} is wrong, and without it: {}", answer.what_is_wrong, alignment.reason);
  }
  return alignment;
}

Camera SolvedCamera(const Measurement& measurement, const Alignment& alignment) {
  Camera camera = measurement.camera;
  camera.focal_length_mm = alignment.focal_length_mm;
  camera.taper_from_camera.translation_mm = alignment.camera_offset_mm;
  return camera;
}

const PartTarget* FindTarget(const Measurement& measurement, const std::string& id) {
  const auto found = std::find_if(measurement.targets.begin(), measurement.targets.end(),
                                  [&id](const PartTarget& target) { return target.id == id; });
  return found == measurement.targets.end() ? nullptr : &*found;
}

std::optional<Eigen::Vector2d> ImageOf(const Measurement& measurement, const Alignment& alignment,
                                       const View& view, const PartTarget& target) {
  const Camera camera = SolvedCamera(measurement, alignment);
  const auto pixel = Project(camera, CameraFromPart(camera, alignment.clamping, view,
                                                    alignment.machine_from_part, target.ideal_mm));
  const bool inside = pixel && pixel->x() >= 0 && pixel->y() >= 0 &&
                      pixel->x() <= camera.width_px - 1 && pixel->y() <= camera.height_px - 1;
  return inside ? pixel : std::nullopt;
}

DistanceRange SeenDistances(const Measurement& measurement, const Alignment& alignment) {
  const Camera camera = SolvedCamera(measurement, alignment);
  DistanceRange range{std::numeric_limits<double>::infinity(), 0};
  for (const View& view : measurement.views) {
    for (const Observation& seen : view.observations) {
      const PartTarget* target = FindTarget(measurement, seen.target);
      if (target == nullptr) continue;
      const double away_mm = std::abs(CameraFromPart(camera, alignment.clamping, view,
                                                     alignment.machine_from_part, target->ideal_mm)
                                          .z());
      range.nearest_mm = std::min(range.nearest_mm, away_mm);
      range.farthest_mm = std::max(range.farthest_mm, away_mm);
    }
  }
  if (range.farthest_mm == 0) range.nearest_mm = 0;
  return range;
}

namespace {

/// Returns the largest standard uncertainty of x, y and z.
double PlaceSigma(const Alignment& alignment) {
  if (alignment.covariance.rows() < 3) return 0;
  return std::sqrt(alignment.covariance.diagonal().head<3>().maxCoeff());
}

}  // namespace

std::vector<std::string> Caveats(const Measurement& measurement, const SolveOptions& options,
                                 const Alignment& alignment,
                                 const std::optional<CalibrationRecord>& calibration,
                                 std::string_view today) {
  std::vector<std::string> caveats;
  if (alignment.verdict != Verdict::kGood) return caveats;
  if (const double sigma_mm = PlaceSigma(alignment); sigma_mm > options.weakest_limit_mm) {
    caveats.push_back(fmt::format(
        "what is stated of the inputs leaves the part's place uncertain by {:.3g} mm (95 %), "
        "however well the views tell it: look at input_uncertainty, its units and the camera's "
        "covariance",
        2 * sigma_mm));
  }
  if (!calibration) return caveats;
  const DistanceRange seen = SeenDistances(measurement, alignment);
  if (seen.nearest_mm < calibration->nearest_mm || seen.farthest_mm > calibration->farthest_mm) {
    caveats.push_back(fmt::format(
        "targets were seen from {:.0f} … {:.0f} mm, but the camera was calibrated ({}) from {:.0f} "
        "to {:.0f} mm: its figures are extrapolated",
        seen.nearest_mm, seen.farthest_mm, calibration->date, calibration->nearest_mm,
        calibration->farthest_mm));
  }
  if (auto old = NoticeOfAge(calibration->date, today)) caveats.push_back(std::move(*old));
  return caveats;
}

}  // namespace trammel::part_alignment
