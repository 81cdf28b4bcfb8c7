#include "part_alignment/pose/pose_uncertainty.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <numbers>
#include <optional>
#include <utility>

#include "base/statistics.h"
#include "geometry/linear_systems.h"
#include "part_alignment/pose/joint_fit.h"
#include "part_alignment/pose/pose_fit.h"
#include "part_alignment/pose/solve.h"

namespace trammel::part_alignment {
using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::Vector2d;
using Eigen::Vector3d;

namespace {

/// Removes the observations that the answer left out.
Measurement Kept(Measurement measurement, const Alignment& alignment) {
  for (const AlignmentResidual& residual : alignment.residuals) {
    if (residual.weight != 0 || residual.view >= measurement.views.size()) continue;
    std::erase_if(measurement.views[residual.view].observations,
                  [&](const Observation& seen) { return seen.target == residual.target; });
  }
  return measurement;
}

/// Checks the fixed part of the model at the state. The solver assumes a centred clamping unless it
/// solves for it, so a state with another clamping would be a bias, not an uncertainty.
Result<void> CheckFixed(const Unknowns& unknowns, const AlignmentState& state) {
  const Clamping& clamping = state.clamping;
  if ((!unknowns.clamp_angle && clamping.angle_rad != 0) ||
      (!unknowns.clamp_eccentricity && !clamping.eccentricity_mm.isZero(0)) ||
      (!unknowns.clamp_tilt && !clamping.tilt_rad.isZero(0))) {
    return Fail(
        "the state has a clamping that is not among the unknowns: solve for it, or give it as an "
        "uncertainty about 0");
  }
  return {};
}

Result<PoseSolver> Prepare(const Measurement& measurement, const SolveOptions& options,
                           const AlignmentState& state) {
  TRY(CheckFixed(options.unknowns, state));
  return PoseSolver::Make(measurement, options, state.machine_from_part, state.clamping);
}

/// Draws all inputs once and computes the camera's view of them. False if it does not see a target.
class Drawer {
 public:
  Drawer(const PoseProblem& problem, const Theta& everything)
      : all_(WithEverything(problem)),
        everything_(everything),
        errors_(problem.errors),
        camera_(ParametersOf(problem.camera)) {
    for (const WeightedObservation& observation : all_.observations) {
      views_ = std::max(views_, observation.view + 1);
      targets_ = std::max(targets_, observation.target + 1);
    }
    view_mm_.resize(views_);
    target_mm_.assign(targets_, Vector3d::Zero());
    target_draws_.resize(errors_.targets.cols());
  }

  bool Draw(Random& random, std::vector<Vector2d>& pixels) {
    const auto draw = [&](double sigma) {
      const double x = sigma * random.Normal();
      const double y = sigma * random.Normal();
      return Vector3d(x, y, sigma * random.Normal());
    };
    std::generate(view_mm_.begin(), view_mm_.end(), [&] { return draw(errors_.machine_mm); });
    DrawTargets(random);
    Theta theta = everything_;
    for (Index i = 6; i < theta.size(); ++i) {
      theta[i] += errors_.common[i] * random.Normal();
    }
    if (errors_.camera) {
      DrawCamera(random, theta);
    }
    const Chain chain(all_, theta, false);
    for (std::size_t i = 0; i < all_.observations.size(); ++i) {
      WeightedObservation observation = all_.observations[i];
      observation.spindle_mm += view_mm_[observation.view];
      observation.part_mm += target_mm_[observation.target];
      observation.pixel.setZero();
      Vector2d residual_px;
      if (!chain.Residual(observation, residual_px)) {
        return false;
      }
      const double column_px = observation.pixel_sigma_px * random.Normal();
      pixels[i] = -residual_px + Vector2d(column_px, observation.pixel_sigma_px * random.Normal());
    }
    return true;
  }

 private:
  void DrawTargets(Random& random) {
    if (errors_.targets.size() == 0) return;
    for (double& draw : target_draws_) draw = random.Normal();
    const Eigen::VectorXd moved_mm = errors_.targets * target_draws_;
    for (std::size_t i = 0; i < target_mm_.size(); ++i) {
      target_mm_[i] = moved_mm.segment<3>(3 * static_cast<Index>(i));
    }
  }

  // Focal length and offset are theta's, the other parameters the camera's own.
  void DrawCamera(Random& random, Theta& theta) {
    CameraVector draws;
    std::generate(draws.begin(), draws.end(), [&] { return random.Normal(); });
    const CameraVector moved = *errors_.camera * draws;
    all_.camera = WithParameters(all_.camera, camera_ + moved);
    const Layout layout = LayoutOf(all_.unknowns);
    theta[layout.focal_length] += moved[0];
    theta.segment<3>(layout.camera_offset) += moved.segment<3>(7);
  }

  PoseProblem all_;
  Theta everything_;
  InputErrors errors_;
  CameraVector camera_;
  std::size_t views_ = 0;
  std::size_t targets_ = 0;
  std::vector<Vector3d> view_mm_;
  std::vector<Vector3d> target_mm_;
  Eigen::VectorXd target_draws_;
};

/// Computes moments, quantiles and the share within the linear region; errors: one column per
/// trial.
void Summarise(const MatrixXd& errors, const MatrixXd& linear, MonteCarloUncertainty& result) {
  const Index unknowns = errors.rows();
  const double count = static_cast<double>(errors.cols());
  result.mean_error = errors.rowwise().mean();
  const MatrixXd centred = errors.colwise() - result.mean_error;
  result.covariance = centred * centred.transpose() / (count - 1);
  result.low95.resize(unknowns);
  result.high95.resize(unknowns);
  for (Index i = 0; i < unknowns; ++i) {
    Eigen::VectorXd row = errors.row(i);
    std::sort(row.begin(), row.end());
    const auto at = [&](double share) { return row[std::lround(share * (count - 1))]; };
    result.low95[i] = at(0.025);
    result.high95[i] = at(0.975);
  }
  const double radius2 = ChiSquareQuantile(0.95, static_cast<int>(unknowns));
  const Eigen::VectorXd scale = linear.diagonal().cwiseSqrt().cwiseInverse();
  const MatrixXd correlation = scale.asDiagonal() * linear * scale.asDiagonal();
  const MatrixXd scaled = scale.asDiagonal() * errors;
  const MatrixXd solved = geometry::SolveSymmetric(correlation, scaled);
  const auto distances2 = scaled.cwiseProduct(solved).colwise().sum();
  result.inside95 = static_cast<double>((distances2.array() <= radius2).count()) / count;
}

}  // namespace

Result<LinearUncertainty> PropagateLinearly(const Measurement& measurement,
                                            const SolveOptions& options,
                                            const AlignmentState& state) {
  const PoseSolver solver = TRY(Prepare(measurement, options, state));
  const PoseProblem& problem = solver.problem();
  if (!std::isfinite(ChiSquare(problem, solver.state()))) {
    return Fail("a target that the measurement names lies behind the camera at the given state");
  }
  MatrixXd covariance = FitJointly(problem, solver.state()).covariance;
  if (covariance.size() == 0) {
    return Fail("the views do not determine the unknowns: add the view that solve advises");
  }
  return LinearUncertainty{ParameterNames(options.unknowns), std::move(covariance)};
}

Result<MonteCarloUncertainty> SimulateMeasurements(const Measurement& measurement,
                                                   const SolveOptions& options,
                                                   const AlignmentState& state, int trials,
                                                   Random& random) {
  if (trials < 100 || trials > 1'000'000) {
    return Fail(fmt::format("trials is {}, it must lie in 100 ... 1000000", trials));
  }
  const LinearUncertainty linear = TRY(PropagateLinearly(measurement, options, state));
  PoseSolver solver = TRY(Prepare(measurement, options, state));
  const PoseProblem& problem = solver.problem();
  Drawer drawer(problem, EverythingAt(problem, solver.state()));
  MonteCarloUncertainty result;
  result.parameters = linear.parameters;
  std::vector<Vector2d> pixels(problem.observations.size());
  MatrixXd errors(solver.state().size(), trials);
  for (int trial = 0; trial < trials; ++trial) {
    if (!drawer.Draw(random, pixels)) {
      ++result.failed;
      continue;
    }
    const Descent descent = solver.SolvePixels(pixels);
    if (!descent.converged) {
      ++result.failed;
      continue;
    }
    auto error = errors.col(result.trials++);
    error = descent.theta - solver.state();
    for (Index i = 3; i < std::min<Index>(7, error.size()); ++i) {
      const bool angle = i < 6 || options.unknowns.clamp_angle;
      error[i] = angle ? std::remainder(error[i], 2 * std::numbers::pi) : error[i];
    }
  }
  if (result.trials < 100) {
    return Fail(
        fmt::format("only {} of {} simulated measurements could be solved: the stated "
                    "uncertainties are too large for these views",
                    result.trials, trials));
  }
  Summarise(errors.leftCols(result.trials), linear.covariance, result);
  return result;
}

Result<MonteCarloUncertainty> SimulateAnswer(const Measurement& measurement,
                                             const SolveOptions& options,
                                             const Alignment& alignment, int trials,
                                             Random& random) {
  Measurement counted = Kept(measurement, alignment);
  counted.camera = SolvedCamera(measurement, alignment);
  SolveOptions as_counted = options;
  as_counted.inputs = alignment.inputs;
  return SimulateMeasurements(counted, as_counted,
                              {alignment.machine_from_part, alignment.clamping}, trials, random);
}

std::optional<std::string> NoticeOfSimulation(const Alignment& alignment,
                                              const MonteCarloUncertainty& simulated) {
  const Eigen::VectorXd ratios =
      simulated.covariance.diagonal().cwiseQuotient(alignment.covariance.diagonal()).cwiseSqrt();
  constexpr double kShare = 0.95;
  const double trials = simulated.trials;
  const double alike = std::max(0.1, 4 / std::sqrt(2 * trials));
  const double share_alike = std::max(0.02, 4 * std::sqrt(kShare * (1 - kShare) / trials));
  const double least = ratios.minCoeff();
  const double most = ratios.maxCoeff();
  if (most < 1 + alike && least > 1 - alike &&
      std::abs(simulated.inside95 - kShare) < share_alike) {
    return std::nullopt;
  }
  return fmt::format(
      "simulated measurements scatter by {:.2f} to {:.2f} of what is stated, and {:.1f} % of them "
      "lie in the region stated for 95 %: so large uncertainties are not linear, the simulated "
      "ones hold",
      least, most, 100 * simulated.inside95);
}

namespace {

std::optional<Eigen::Vector3d> Sigma(const Measurement& measurement, const SolveOptions& options,
                                     const Alignment& alignment) {
  const auto told =
      PropagateLinearly(measurement, options, {alignment.machine_from_part, alignment.clamping});
  if (!told || told->covariance.rows() < 3) return std::nullopt;
  return Eigen::Vector3d(told->covariance.diagonal().head<3>().cwiseMax(0).cwiseSqrt());
}

struct Input {
  std::string name;
  double size = 0;
  bool counts = false;
  std::function<void(SolveOptions&)> make_exact;
};

std::vector<Input> InputsOf(const SolveOptions& options) {
  std::vector<Input> inputs;
  for (const UncertainInput& input : kUncertainInputs) {
    const double size = (options.inputs.*input.size).value_or(0);
    const bool solved = input.unknown != nullptr && options.unknowns.*input.unknown;
    inputs.push_back({input.name, size, size > 0 && !solved,
                      [member = input.size](SolveOptions& o) { o.inputs.*member = 0; }});
  }
  inputs.push_back({"targets", 0, options.target_covariance.has_value(),
                    [](SolveOptions& o) { o.target_covariance.reset(); }});
  inputs.push_back({"camera", 0, options.camera_covariance.has_value(),
                    [](SolveOptions& o) { o.camera_covariance.reset(); }});
  return inputs;
}

}  // namespace

std::vector<Contribution> ContributionsOf(const Measurement& measurement,
                                          const SolveOptions& stated, const Alignment& alignment) {
  if (alignment.verdict != Verdict::kGood) return {};
  SolveOptions options = stated;
  options.inputs = alignment.inputs;
  const Measurement kept = Kept(measurement, alignment);
  const auto all = Sigma(kept, options, alignment);
  if (!all) return {};
  std::vector<Contribution> parts;
  SolveOptions exact = options;
  for (const Input& input : InputsOf(options)) {
    if (!input.counts) continue;
    SolveOptions without = options;
    input.make_exact(without);
    input.make_exact(exact);
    const auto sigma = Sigma(kept, without, alignment);
    if (!sigma) continue;
    const bool usual = std::find(alignment.usual_inputs.begin(), alignment.usual_inputs.end(),
                                 input.name) != alignment.usual_inputs.end();
    parts.push_back({input.name, input.size, usual, *sigma});
  }
  std::stable_sort(parts.begin(), parts.end(), [](const Contribution& a, const Contribution& b) {
    return a.sigma_mm.norm() < b.sigma_mm.norm();
  });
  parts.insert(parts.begin(), Contribution{"all", 0, false, *all});
  if (const auto pixels = Sigma(kept, exact, alignment)) {
    parts.push_back({"pixels", 0, false, *pixels});
  }
  return parts;
}

}  // namespace trammel::part_alignment
