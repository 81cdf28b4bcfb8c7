#include "part_alignment/pose/joint_fit.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>
#include <vector>

#include "base/statistics.h"
#include "geometry/decompositions.h"
#include "geometry/linear_systems.h"
#include "part_alignment/pose/pose_fit.h"

namespace trammel::part_alignment {
using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::Vector2d;
using Eigen::VectorXd;

namespace {

const Unknowns kEverything{true, true, true, true, true};

}  // namespace

Theta CommonSigmas(const InputUncertainty& inputs, const Unknowns& unknowns) {
  const Layout all = LayoutOf(kEverything);
  Theta sigmas = Theta::Zero(all.size);
  const auto set = [&](bool solved, int first, int count, double sigma) {
    sigmas.segment(first, count).setConstant(solved ? 0 : sigma);
  };
  set(unknowns.clamp_angle, all.clamp_angle, 1, inputs.clamp_angle_rad.value());
  set(unknowns.clamp_eccentricity, all.clamp_eccentricity, 2, inputs.clamp_eccentricity_mm.value());
  set(unknowns.clamp_tilt, all.clamp_tilt, 2, inputs.clamp_tilt_rad.value());
  set(unknowns.focal_length, all.focal_length, 1, inputs.focal_length_mm.value());
  set(unknowns.camera_offset, all.camera_offset, 3, inputs.camera_offset_mm.value());
  return sigmas;
}

PoseProblem WithEverything(const PoseProblem& problem) {
  PoseProblem all = problem;
  all.unknowns = kEverything;
  return all;
}

Theta EverythingAt(const PoseProblem& problem, const Theta& theta) {
  PoseProblem all = WithEverything(problem);
  all.camera = CameraOf(problem, theta);
  return ThetaOf(all, PoseOf(theta), ClampingOf(LayoutOf(problem.unknowns), theta));
}

CameraCovariance CountingRoot(const Unknowns& unknowns, const CameraCovariance& covariance) {
  CameraCovariance root = geometry::CovarianceRoot(covariance);
  if (unknowns.focal_length) {
    root.row(0).setZero();
  }
  if (unknowns.camera_offset) {
    root.middleRows<3>(7).setZero();
  }
  return root;
}

InputErrors ErrorsOf(const InputUncertainty& inputs, const Unknowns& unknowns,
                     std::size_t target_count, const std::optional<MatrixXd>& targets,
                     const std::optional<CameraCovariance>& camera) {
  InputErrors errors{inputs.machine_mm.value(), CommonSigmas(inputs, unknowns), {}, {}};
  const auto rows = 3 * static_cast<Index>(target_count);
  const double alone_mm = inputs.target_mm.value();
  if (targets) {
    errors.targets =
        geometry::CovarianceRoot(*targets + alone_mm * alone_mm * MatrixXd::Identity(rows, rows));
  } else if (alone_mm > 0) {
    errors.targets = alone_mm * MatrixXd::Identity(rows, rows);
  }
  if (camera) errors.camera = CountingRoot(unknowns, *camera);
  return errors;
}

void InflateSigmas(const Theta& theta, PoseProblem& problem) {
  const InputErrors& errors = problem.errors;
  const Chain chain(problem, theta, true);
  Vector2d residual_px;
  ObservationDerivative derivative;
  for (WeightedObservation& observation : problem.observations) {
    observation.sigma_px = observation.pixel_sigma_px;
    double squares_mm2 = errors.machine_mm * errors.machine_mm;
    if (errors.targets.size() > 0) {
      squares_mm2 +=
          errors.targets.middleRows<3>(3 * static_cast<Index>(observation.target)).squaredNorm() /
          3;
    }
    if (squares_mm2 > 0 && chain.ResidualAndDerivative(observation, residual_px, derivative)) {
      const double px_per_mm = derivative.leftCols<3>().norm() / std::sqrt(2.0);
      observation.sigma_px =
          std::hypot(observation.pixel_sigma_px, px_per_mm * std::sqrt(squares_mm2));
    }
  }
}

std::vector<CameraMove> CameraMoves(const PoseProblem& problem, const Theta& theta,
                                    const CameraCovariance& root) {
  const Camera camera = CameraOf(problem, theta);
  const Eigen::Matrix3d rotation =
      geometry::RotationFromAngles(camera.taper_from_camera.angles_rad);
  const Clamping clamping = ClampingOf(LayoutOf(problem.unknowns), theta);
  std::vector<CameraMove> moves;
  for (const WeightedObservation& observation : problem.observations) {
    const View view{observation.spindle_mm, observation.spindle_from_machine.transpose(), {}};
    const Eigen::Vector3d taper_mm =
        rotation * CameraFromPart(camera, clamping, view, PoseOf(theta), observation.part_mm) +
        camera.taper_from_camera.translation_mm;
    const auto projected = ProjectFromTaper(camera, taper_mm);
    moves.push_back(projected ? CameraMove(projected->by_parameter.lazyProduct(root))
                              : CameraMove::Zero());
  }
  return moves;
}

namespace {

/// (1 + M·Mᵀ)^(-1/2) of a view's rows M by the machine's errors of unit variance, as 1 less what
/// few directions lose: a view may see thousands of targets.
struct Whitener {
  MatrixXd u;  ///< rows × 3
  VectorXd shrink;

  explicit Whitener(const MatrixXd& by_machine) {
    const geometry::SingularValues of = geometry::DecomposeSingular(by_machine);
    u = of.u;
    shrink = (1 - (1 + of.values.array().square()).sqrt().inverse()).matrix();
  }
  /// Whitener · rows, in place.
  void FromLeft(Eigen::Ref<MatrixXd> rows) const {
    const MatrixXd lost = shrink.asDiagonal() * (u.transpose() * rows);
    rows -= u * lost;
  }
  /// Columns · whitener, in place.
  void FromRight(auto&& columns) const {
    const MatrixXd lost = (columns * u) * shrink.asDiagonal();
    columns -= lost * u.transpose();
  }
};

/// Residuals in sigmas, and their derivatives by theta and by each error of unit variance. The
/// machine's own error is whitened out of each view's rows.
struct Rows {
  MatrixXd by_theta;
  MatrixXd by_error;  ///< common errors first, then targets', then the camera's
  VectorXd residuals;
  std::vector<Whitener> whiteners;  ///< one for each view's block of rows; empty: nothing whitened
};

/// Calls `use` with the first row and the number of rows of each view's observations, which are
/// adjacent.
template <class Use>
void ForEachView(const std::vector<WeightedObservation>& observations, Use use) {
  for (std::size_t first = 0; first < observations.size();) {
    std::size_t end = first;
    while (end < observations.size() && observations[end].view == observations[first].view) ++end;
    use(2 * static_cast<Index>(first), 2 * static_cast<Index>(end - first));
    first = end;
  }
}

void AddTargetErrors(const PoseProblem& problem, const Theta& theta, Index first, Rows& rows) {
  const MatrixXd& root = problem.errors.targets;
  const Eigen::Matrix3d turn = geometry::RotationFromAngles(theta.segment<3>(3));
  for (std::size_t i = 0; i < problem.observations.size(); ++i) {
    const Index row = 2 * static_cast<Index>(i);
    rows.by_error.block(row, first, 2, root.cols()) =
        rows.by_theta.block<2, 3>(row, 0) * turn *
        root.middleRows<3>(3 * static_cast<Index>(problem.observations[i].target));
  }
}

void AddCameraErrors(const PoseProblem& problem, const Theta& theta, Index first, Rows& rows) {
  const std::vector<CameraMove> moves = CameraMoves(problem, theta, *problem.errors.camera);
  for (std::size_t i = 0; i < problem.observations.size(); ++i) {
    rows.by_error.block<2, kCameraParameters>(2 * static_cast<Index>(i), first) =
        moves[i] / problem.observations[i].pixel_sigma_px;
  }
}

void Whiten(const PoseProblem& problem, double machine_mm, Rows& rows) {
  if (!(machine_mm > 0)) return;
  ForEachView(problem.observations, [&](Index first, Index count) {
    const Whitener whitener(machine_mm * rows.by_theta.block(first, 0, count, 3));
    whitener.FromLeft(rows.by_theta.middleRows(first, count));
    if (rows.by_error.cols() > 0) whitener.FromLeft(rows.by_error.middleRows(first, count));
    whitener.FromLeft(rows.residuals.segment(first, count));
    rows.whiteners.push_back(whitener);
  });
}

/// Fills in the rows without whitening; false if a target is not visible.
bool FillRows(const PoseProblem& problem, const Theta& theta, Rows& rows) {
  PoseProblem alone = problem;
  for (WeightedObservation& observation : alone.observations)
    observation.sigma_px = observation.pixel_sigma_px;
  rows.by_theta = WeightedJacobian(alone, theta);
  if (rows.by_theta.size() == 0) return false;
  const InputErrors& errors = problem.errors;
  const bool common = errors.common.size() > 6 && !errors.common.isZero(0);
  const Index common_count = common ? errors.common.size() - 6 : 0;
  const Index camera_count = errors.camera ? kCameraParameters : 0;
  const Index count = rows.by_theta.rows();
  rows.by_error.resize(count, common_count + errors.targets.cols() + camera_count);
  rows.residuals.resize(count);
  const Chain chain(problem, theta, false);
  for (std::size_t i = 0; i < problem.observations.size(); ++i) {
    Eigen::Vector2d residual_px;
    if (!chain.Residual(problem.observations[i], residual_px)) return false;
    rows.residuals.segment<2>(2 * static_cast<Index>(i)) =
        residual_px / problem.observations[i].pixel_sigma_px;
  }
  if (common) {
    const MatrixXd all = WeightedJacobian(WithEverything(alone), EverythingAt(problem, theta));
    rows.by_error.leftCols(common_count) =
        all.rightCols(common_count) * errors.common.tail(common_count).asDiagonal();
  }
  if (errors.targets.size() > 0) AddTargetErrors(problem, theta, common_count, rows);
  if (errors.camera) {
    AddCameraErrors(problem, theta, rows.by_error.cols() - camera_count, rows);
  }
  return true;
}

/// Whitened rows without the part that theta absorbs.
struct Reduced {
  Rows rows;
  geometry::PivotedOrthogonal of;  ///< decomposes by_theta, columns scaled to 1
  VectorXd scale;
  MatrixXd left;            ///< reduced by_error
  VectorXd remaining;       ///< reduced residuals
  MatrixXd stiffness_root;  ///< lower
  VectorXd draws;           ///< the likeliest errors
  bool seen = false;        ///< all targets are; nothing else is meant without
  bool full_rank = false;
  double chi_square = std::numeric_limits<double>::infinity();
};

/// Removes from residuals and errors the part that theta absorbs; the errors are not estimated yet.
Reduced TakeOutTheta(Rows whitened) {
  constexpr double kSingular = 1e-9;
  Reduced reduced;
  reduced.rows = std::move(whitened);
  const Rows& rows = reduced.rows;
  reduced.seen = true;
  reduced.scale = rows.by_theta.colwise().norm().cwiseMax(1e-300).cwiseInverse();
  reduced.of = geometry::DecomposePivoted(rows.by_theta * reduced.scale.asDiagonal());
  const VectorXd sizes = reduced.of.r.diagonal().cwiseAbs();
  const Index rank = (sizes.array() > kSingular * sizes[0]).count();
  reduced.full_rank = rank == rows.by_theta.cols();
  const auto taken_up = reduced.of.q.leftCols(rank);
  reduced.remaining = rows.residuals - taken_up * (taken_up.transpose() * rows.residuals);
  reduced.chi_square = reduced.remaining.squaredNorm();
  reduced.left = rows.by_error - taken_up * (taken_up.transpose() * rows.by_error);
  return reduced;
}

Reduced TakeOutTheta(const PoseProblem& problem, const Theta& theta) {
  Rows rows;
  if (!FillRows(problem, theta, rows)) return {};
  Whiten(problem, problem.errors.machine_mm, rows);
  return TakeOutTheta(std::move(rows));
}

/// Estimates the errors together with theta.
Reduced AddErrors(Reduced reduced) {
  if (!reduced.seen || reduced.left.cols() == 0) return reduced;
  const MatrixXd stiffness = MatrixXd::Identity(reduced.left.cols(), reduced.left.cols()) +
                             reduced.left.transpose() * reduced.left;
  reduced.stiffness_root = geometry::CholeskyRoot(stiffness);
  const VectorXd pull =
      geometry::SolveLower(reduced.stiffness_root, reduced.left.transpose() * reduced.remaining);
  reduced.draws = geometry::SolveUpper(reduced.stiffness_root.transpose(), pull);
  reduced.chi_square -= pull.squaredNorm();
  return reduced;
}

Reduced Reduce(const PoseProblem& problem, const Theta& theta) {
  return AddErrors(TakeOutTheta(problem, theta));
}

void FillEstimate(const PoseProblem& problem, const Reduced& reduced, JointFit& fit) {
  const Rows& rows = reduced.rows;
  const MatrixXd by_column = geometry::SolveUpper(reduced.of.r, reduced.of.q.transpose());
  MatrixXd inverse(by_column.rows(), by_column.cols());
  for (Index k = 0; k < by_column.rows(); ++k) {
    const Index column = reduced.of.order[k];
    inverse.row(column) = reduced.scale[column] * by_column.row(k);
  }
  fit.covariance = inverse * inverse.transpose();
  fit.gain = inverse;
  if (rows.by_error.cols() > 0) {
    const MatrixXd& root = reduced.stiffness_root;
    const MatrixXd moved =
        geometry::SolveLower(root, (inverse * rows.by_error).transpose()).transpose();
    fit.covariance += moved * moved.transpose();
    fit.gain -= moved * geometry::SolveLower(root, reduced.left.transpose());
    const Index common = fit.common.size() - 6;
    if (!problem.errors.common.isZero(0)) {
      fit.common.tail(common) =
          problem.errors.common.tail(common).cwiseProduct(reduced.draws.head(common));
    }
  }
  fit.step = fit.gain * rows.residuals;
  if (!rows.whiteners.empty()) {
    auto whitener = rows.whiteners.begin();
    ForEachView(problem.observations, [&](Index first, Index count) {
      (whitener++)->FromRight(fit.gain.middleCols(first, count));
    });
  }
  for (std::size_t i = 0; i < problem.observations.size(); ++i) {
    fit.gain.middleCols<2>(2 * static_cast<Index>(i)) /= problem.observations[i].pixel_sigma_px;
  }
}

}  // namespace

JointFit FitJointly(const PoseProblem& problem, const Theta& theta) {
  const Reduced reduced = Reduce(problem, theta);
  JointFit fit;
  fit.chi_square = reduced.chi_square;
  fit.common = Theta::Zero(LayoutOf(WithEverything(problem).unknowns).size);
  if (reduced.full_rank) FillEstimate(problem, reduced, fit);
  return fit;
}

double JointChiSquare(const PoseProblem& problem, const Theta& theta) {
  return Reduce(problem, theta).chi_square;
}

std::function<double(double)> JointChiSquareByMachine(const PoseProblem& problem,
                                                      const Theta& theta) {
  Rows rows;
  if (!FillRows(problem, theta, rows))
    return [](double) { return std::numeric_limits<double>::infinity(); };
  return [problem, rows](double machine_mm) {
    Rows whitened = rows;
    Whiten(problem, machine_mm, whitened);
    return AddErrors(TakeOutTheta(std::move(whitened))).chi_square;
  };
}

TargetDirections DirectionsOfTargets(const PoseProblem& problem, const Theta& theta) {
  constexpr double kReached = 1e-6;
  const Index count = problem.errors.targets.cols();
  Reduced reduced = TakeOutTheta(problem, theta);
  if (!reduced.seen || count == 0) return {};
  const Index camera_count = problem.errors.camera ? kCameraParameters : 0;
  const Index first = reduced.left.cols() - camera_count - count;
  MatrixXd by_target = reduced.left.middleCols(first, count);
  MatrixXd shared(by_target.rows(), first + camera_count);
  shared << reduced.left.leftCols(first), reduced.left.rightCols(camera_count);
  if (shared.cols() > 0) {
    const Whitener whitener(shared);
    whitener.FromLeft(by_target);
    whitener.FromLeft(reduced.remaining);
  }
  const geometry::SymmetricEigen of =
      geometry::DecomposeSymmetric(by_target.transpose() * by_target);
  const Index reached = (of.values.array() > kReached).count();
  TargetDirections directions;
  directions.reach = of.values.tail(reached).cwiseSqrt();
  directions.residual =
      (of.vectors.rightCols(reached).transpose() * (by_target.transpose() * reduced.remaining))
          .cwiseQuotient(directions.reach);
  return directions;
}

double RepeatabilityByResiduals(const PoseProblem& problem, const Theta& theta,
                                bool targets_known) {
  constexpr int kTrialRuns = 4;
  constexpr double kOneInTen = 0.1;
  constexpr double kNear = 1.01;
  PoseProblem tried = problem;
  int freedom = DegreesOfFreedom(problem);
  if (!targets_known) {
    constexpr double kAnyTimes = 1000;
    constexpr double kExplained_sigma = 30;
    tried.errors.targets *= kAnyTimes;
    const Eigen::VectorXd reach = DirectionsOfTargets(tried, theta).reach;
    freedom -= static_cast<int>((reach.array() > kExplained_sigma).count());
  }
  const double wanted = ChiSquareQuantile(kOneInTen, std::max(0, freedom) + kTrialRuns);
  const auto chi_square = JointChiSquareByMachine(tried, theta);
  const auto too_small = [&](double machine_mm) {
    const double share = kUsualRepeatability_mm / machine_mm;
    return chi_square(machine_mm) + kTrialRuns * share * share > wanted;
  };
  double low_mm = kUsualRepeatability_mm / 10;
  double high_mm = 2 * kWorstRepeatability_mm;
  if (too_small(high_mm)) return high_mm;
  while (high_mm > kNear * low_mm) {
    const double middle_mm = std::sqrt(low_mm * high_mm);
    (too_small(middle_mm) ? low_mm : high_mm) = middle_mm;
  }
  return high_mm;
}

double TargetErrorByResiduals(const PoseProblem& problem, const Theta& theta, double usual_mm,
                              double share) {
  constexpr double kShows_sigma = 1;
  constexpr double kMax = 1e6;
  constexpr double kNear = 1.01;
  const TargetDirections all = DirectionsOfTargets(problem, theta);
  const Eigen::Index count = (all.reach.array() >= kShows_sigma).count();
  if (count == 0) return usual_mm;
  // Ascending order, so that those that show are last.
  const auto reach = all.reach.tail(count).array();
  const auto residual = all.residual.tail(count).array();
  const double wanted = ChiSquareQuantile(share, static_cast<int>(count));
  const auto too_small = [&](double times) {
    return (residual.square() / (1 + (times * reach).square())).sum() > wanted;
  };
  double low = 1;
  double high = kMax;
  if (!too_small(low)) return usual_mm;
  while (high > kNear * low) {
    const double middle = std::sqrt(low * high);
    (too_small(middle) ? low : high) = middle;
  }
  return high * usual_mm;
}

}  // namespace trammel::part_alignment
