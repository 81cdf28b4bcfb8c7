#include "part_alignment/pose_uncertainty.h"

#include <fmt/format.h>

#include <Eigen/Cholesky>
#include <Eigen/SVD>
#include <algorithm>
#include <array>
#include <cmath>
#include <map>
#include <numbers>
#include <string_view>

#include "part_alignment/chi_square.h"
#include "part_alignment/observability.h"
#include "part_alignment/pose_solver.h"

namespace trammel::part_alignment {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::Vector2d;
using Eigen::Vector3d;

const Unknowns kEverything{true, true, true, true, true};

Result<void> Validate(const InputUncertainty& inputs) {
  struct Field {
    std::string_view name;
    double value;
  };
  const std::array fields{Field{"machine_mm", inputs.machine_mm},
                          Field{"target_mm", inputs.target_mm},
                          Field{"clamp_angle_rad", inputs.clamp_angle_rad},
                          Field{"clamp_eccentricity_mm", inputs.clamp_eccentricity_mm},
                          Field{"clamp_tilt_rad", inputs.clamp_tilt_rad},
                          Field{"focal_length_mm", inputs.focal_length_mm},
                          Field{"camera_offset_mm", inputs.camera_offset_mm}};
  for (const Field& field : fields) {
    if (!(field.value >= 0 && field.value <= 1000)) {
      return Fail(
          fmt::format("uncertainty {} is {}, it must lie in 0 ... 1000", field.name, field.value));
    }
  }
  return {};
}

/// The standard uncertainty of each of kEverything's entries that is not solved for, else 0.
Theta CommonSigmas(const InputUncertainty& inputs, const Unknowns& unknowns) {
  const Layout all = LayoutOf(kEverything);
  Theta sigmas = Theta::Zero(all.size);
  const auto set = [&](bool solved, int first, int count, double sigma) {
    sigmas.segment(first, count).setConstant(solved ? 0 : sigma);
  };
  set(unknowns.clamp_angle, all.clamp_angle, 1, inputs.clamp_angle_rad);
  set(unknowns.clamp_eccentricity, all.clamp_eccentricity, 2, inputs.clamp_eccentricity_mm);
  set(unknowns.clamp_tilt, all.clamp_tilt, 2, inputs.clamp_tilt_rad);
  set(unknowns.focal_length, all.focal_length, 1, inputs.focal_length_mm);
  set(unknowns.camera_offset, all.camera_offset, 3, inputs.camera_offset_mm);
  return sigmas;
}

PoseProblem WithEverything(const PoseProblem& problem) {
  PoseProblem all = problem;
  all.unknowns = kEverything;
  return all;
}

/// theta changes by this matrix times the change of the weighted residuals. Empty below full rank.
MatrixXd Gain(const PoseProblem& problem, const Theta& theta) {
  const MatrixXd jacobian = WeightedJacobian(problem, theta);
  if (jacobian.size() == 0 || jacobian.rows() < jacobian.cols()) {
    return {};
  }
  const Eigen::VectorXd scale = jacobian.colwise().norm().cwiseInverse();
  const Eigen::JacobiSVD<MatrixXd> svd(jacobian * scale.asDiagonal(),
                                       Eigen::ComputeThinU | Eigen::ComputeThinV);
  constexpr double kSingular = 1e-9;
  const auto& values = svd.singularValues();
  if (!scale.allFinite() || values.minCoeff() < kSingular * values.maxCoeff()) {
    return {};
  }
  return scale.asDiagonal() * svd.matrixV() * values.cwiseInverse().asDiagonal() *
         svd.matrixU().transpose();
}

/// What one input does to the weighted residuals: a column for each independent draw, times its
/// sigma.
MatrixXd InputColumns(const PoseProblem& problem, const Theta& everything, const Unknowns& unknowns,
                      const InputUncertainty& inputs) {
  const MatrixXd jacobian = WeightedJacobian(WithEverything(problem), everything);
  const Eigen::Matrix3d turn = geometry::RotationFromAngles(everything.segment<3>(3));
  std::map<std::size_t, Index> views;
  std::map<std::size_t, Index> targets;
  for (const Sight& sight : problem.sights) {
    views.emplace(sight.view, static_cast<Index>(views.size()));
    targets.emplace(sight.target, static_cast<Index>(targets.size()));
  }
  const Index first_target = 3 * static_cast<Index>(views.size());
  const Index first_common = first_target + 3 * static_cast<Index>(targets.size());
  MatrixXd columns = MatrixXd::Zero(jacobian.rows(), first_common + jacobian.cols() - 6);
  for (std::size_t i = 0; i < problem.sights.size(); ++i) {
    const Index row = 2 * static_cast<Index>(i);
    const Sight& sight = problem.sights[i];
    const Eigen::Matrix<double, 2, 3> by_machine = jacobian.block<2, 3>(row, 0);
    columns.block<2, 3>(row, 3 * views[sight.view]) = -inputs.machine_mm * by_machine;
    columns.block<2, 3>(row, first_target + 3 * targets[sight.target]) =
        inputs.target_mm * by_machine * turn;
  }
  const Theta sigmas = CommonSigmas(inputs, unknowns);
  columns.rightCols(jacobian.cols() - 6) =
      jacobian.rightCols(jacobian.cols() - 6) * sigmas.tail(jacobian.cols() - 6).asDiagonal();
  return columns;
}

/// The state with every entry that can be one; the camera's own focal length and offset.
Theta EverythingAt(const PoseProblem& problem, const AlignmentState& state) {
  return ThetaOf(WithEverything(problem), state.machine_from_part, state.clamping);
}

/// The fixed part of the model at the state: the solver takes the clamping that it does not solve
/// for as centred, so a state with another clamping would be a bias, not an uncertainty.
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

Result<PoseSolver> Prepare(const Measurement& measurement, const Unknowns& unknowns,
                           const AlignmentState& state, const InputUncertainty& inputs) {
  if (const auto valid = Validate(inputs); !valid) {
    return tl::unexpected(valid.error());
  }
  if (const auto valid = CheckFixed(unknowns, state); !valid) {
    return tl::unexpected(valid.error());
  }
  return PoseSolver::Make(measurement, unknowns, state.machine_from_part, state.clamping);
}

/// One draw of all inputs: what the camera sees then. False where it does not see a target.
class Drawer {
 public:
  Drawer(const PoseProblem& problem, const Theta& everything, const Unknowns& unknowns,
         const InputUncertainty& inputs)
      : all_(WithEverything(problem)),
        everything_(everything),
        inputs_(inputs),
        sigmas_(CommonSigmas(inputs, unknowns)) {
    for (const Sight& sight : all_.sights) {
      views_ = std::max(views_, sight.view + 1);
      targets_ = std::max(targets_, sight.target + 1);
    }
    view_mm_.resize(views_);
    target_mm_.resize(targets_);
  }

  bool Draw(Random& random, std::vector<Vector2d>& pixels) {
    const auto draw = [&](double sigma) {
      const double x = sigma * random.Normal();
      const double y = sigma * random.Normal();
      return Vector3d(x, y, sigma * random.Normal());
    };
    std::generate(view_mm_.begin(), view_mm_.end(), [&] { return draw(inputs_.machine_mm); });
    std::generate(target_mm_.begin(), target_mm_.end(), [&] { return draw(inputs_.target_mm); });
    Theta theta = everything_;
    for (Index i = 6; i < theta.size(); ++i) {
      theta[i] += sigmas_[i] * random.Normal();
    }
    const Chain chain(all_, theta, false);
    for (std::size_t i = 0; i < all_.sights.size(); ++i) {
      Sight sight = all_.sights[i];
      sight.spindle_mm += view_mm_[sight.view];
      sight.part_mm += target_mm_[sight.target];
      sight.pixel.setZero();
      Vector2d residual_px;
      if (!chain.Residual(sight, residual_px)) {
        return false;
      }
      const double column_px = sight.sigma_px * random.Normal();
      pixels[i] = -residual_px + Vector2d(column_px, sight.sigma_px * random.Normal());
    }
    return true;
  }

 private:
  PoseProblem all_;
  Theta everything_;
  InputUncertainty inputs_;
  Theta sigmas_;
  std::size_t views_ = 0;
  std::size_t targets_ = 0;
  std::vector<Vector3d> view_mm_;
  std::vector<Vector3d> target_mm_;
};

/// Moments, quantiles and the share within the linear region; errors: one column per trial.
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
  const MatrixXd solved = correlation.ldlt().solve(scaled);
  const auto distances2 = scaled.cwiseProduct(solved).colwise().sum();
  result.inside95 = static_cast<double>((distances2.array() <= radius2).count()) / count;
}

}  // namespace

Result<LinearUncertainty> PropagateLinearly(const Measurement& measurement,
                                            const Unknowns& unknowns, const AlignmentState& state,
                                            const InputUncertainty& inputs) {
  const auto solver = Prepare(measurement, unknowns, state, inputs);
  if (!solver) {
    return tl::unexpected(solver.error());
  }
  const PoseProblem& problem = solver->problem();
  if (!std::isfinite(ChiSquare(problem, solver->state()))) {
    return Fail("a target that the measurement names lies behind the camera at the given state");
  }
  const MatrixXd gain = Gain(problem, solver->state());
  if (gain.size() == 0) {
    return Fail("the views do not determine the unknowns: add the view that solve advises");
  }
  const MatrixXd moved =
      gain * InputColumns(problem, EverythingAt(problem, state), unknowns, inputs);
  return LinearUncertainty{ParameterNames(unknowns),
                           gain * gain.transpose() + moved * moved.transpose()};
}

Result<MonteCarloUncertainty> SimulateMeasurements(const Measurement& measurement,
                                                   const Unknowns& unknowns,
                                                   const AlignmentState& state,
                                                   const InputUncertainty& inputs, int trials,
                                                   Random& random) {
  if (trials < 100 || trials > 10'000'000) {
    return Fail(fmt::format("trials is {}, it must lie in 100 ... 10000000", trials));
  }
  const auto linear = PropagateLinearly(measurement, unknowns, state, inputs);
  if (!linear) {
    return tl::unexpected(linear.error());
  }
  auto solver = Prepare(measurement, unknowns, state, inputs);
  if (!solver) {
    return tl::unexpected(solver.error());
  }
  const PoseProblem& problem = solver->problem();
  Drawer drawer(problem, EverythingAt(problem, state), unknowns, inputs);
  MonteCarloUncertainty result;
  result.parameters = linear->parameters;
  std::vector<Vector2d> pixels(problem.sights.size());
  MatrixXd errors(solver->state().size(), trials);
  for (int trial = 0; trial < trials; ++trial) {
    if (!drawer.Draw(random, pixels)) {
      ++result.failed;
      continue;
    }
    const Descent descent = solver->SolvePixels(pixels);
    if (!descent.converged) {
      ++result.failed;
      continue;
    }
    auto error = errors.col(result.trials++);
    error = descent.theta - solver->state();
    for (Index i = 3; i < std::min<Index>(7, error.size()); ++i) {
      const bool angle = i < 6 || unknowns.clamp_angle;
      error[i] = angle ? std::remainder(error[i], 2 * std::numbers::pi) : error[i];
    }
  }
  if (result.trials < 100) {
    return Fail(
        fmt::format("only {} of {} simulated measurements could be solved: the stated "
                    "uncertainties are too large for these views",
                    result.trials, trials));
  }
  Summarise(errors.leftCols(result.trials), linear->covariance, result);
  return result;
}

}  // namespace trammel::part_alignment
