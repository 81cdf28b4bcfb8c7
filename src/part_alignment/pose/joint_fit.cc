#include "part_alignment/pose/joint_fit.h"

#include <cmath>
#include <limits>
#include <utility>
#include <vector>

#include "geometry/decompositions.h"
#include "geometry/linear_systems.h"
#include "part_alignment/pose/input_effect.h"

namespace trammel::part_alignment {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

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

/// Residuals in sigmas, and how they change by theta and by each error of unit variance; of each
/// view's rows the machine's own error is whitened away.
struct Rows {
  MatrixXd by_theta;
  MatrixXd by_error;  ///< common errors first, then targets', then the camera's
  VectorXd residuals;
  std::vector<Whitener> whiteners;  ///< one for each view's block of rows; empty: nothing whitened
};

/// Calls `use` with the first row and the count of rows of each view's observations, which are
/// neighbours.
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

/// False where a target is not seen. Whitens nothing.
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

/// The whitened rows with what theta takes up of them taken out.
struct Reduced {
  Rows rows;
  geometry::PivotedOrthogonal of;  ///< of by_theta, its columns scaled to 1
  VectorXd scale;
  MatrixXd left;            ///< of by_error
  VectorXd remaining;       ///< of the residuals
  MatrixXd stiffness_root;  ///< lower
  VectorXd draws;           ///< the likeliest errors
  bool seen = false;        ///< all targets are; nothing else is meant without
  bool full_rank = false;
  double chi_square = std::numeric_limits<double>::infinity();
};

/// Takes out of residuals and errors what theta takes up; the errors count for nothing yet.
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

/// Estimates the errors beside theta.
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

}  // namespace trammel::part_alignment
