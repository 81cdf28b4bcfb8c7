#include "part_alignment/network/normal.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "geometry/linear_systems.h"

namespace trammel::part_alignment {
using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

namespace {

// Rounding error of an undetermined direction, for a matrix with unit diagonal.
constexpr double kSingular = 1e-11;

VectorXd UnitScale(const MatrixXd& matrix) {
  return matrix.diagonal().unaryExpr([](double d) { return d > 0 ? 1 / std::sqrt(d) : 1.0; });
}

MatrixXd Damped(const MatrixXd& matrix, double damping) {
  MatrixXd damped = matrix;
  damped.diagonal() *= 1 + damping;
  return damped;
}

}  // namespace

Eigen::Matrix3d CrossMatrix(const Eigen::Vector3d& v) {
  Eigen::Matrix3d cross;
  cross << 0, -v.z(), v.y(), v.z(), 0, -v.x(), -v.y(), v.x(), 0;
  return cross;
}

void AddStation(std::size_t station, const std::vector<ObservationRow>& rows,
                NormalEquations& normal) {
  NormalEquations::Station& sums = normal.stations.emplace_back();
  const Index own = rows.front().by_own.cols();
  sums.station = station;
  sums.block.setZero(own, own);
  sums.right.setZero(own);
  for (const ObservationRow& row : rows) {
    sums.unknowns.insert(sums.unknowns.end(), row.unknowns.begin(), row.unknowns.end());
  }
  std::sort(sums.unknowns.begin(), sums.unknowns.end());
  sums.unknowns.erase(std::unique(sums.unknowns.begin(), sums.unknowns.end()), sums.unknowns.end());
  MatrixXd coupling = MatrixXd::Zero(normal.right.size(), own);
  for (const ObservationRow& row : rows) {
    normal.matrix(row.unknowns, row.unknowns) +=
        row.by_shared.transpose().lazyProduct(row.by_shared);
    normal.right(row.unknowns) -= row.by_shared.transpose() * row.residual;
    coupling(row.unknowns, Eigen::all) += row.by_shared.transpose().lazyProduct(row.by_own);
    sums.block += row.by_own.transpose().lazyProduct(row.by_own);
    sums.right -= row.by_own.transpose() * row.residual;
  }
  sums.coupling = coupling(sums.unknowns, Eigen::all);
}

void HoldUnknowns(const std::vector<bool>& held, NormalEquations& normal) {
  std::vector<bool> fixed(static_cast<std::size_t>(normal.right.size()), false);
  for (Index i = 0; i < normal.right.size(); ++i) {
    const auto at = static_cast<std::size_t>(i);
    if (!(at < held.size() && held[at]) && normal.matrix(i, i) > 0) continue;
    fixed[at] = true;
    normal.matrix.row(i).setZero();
    normal.matrix.col(i).setZero();
    normal.matrix(i, i) = 1;
    normal.right[i] = 0;
  }
  for (NormalEquations::Station& station : normal.stations) {
    for (std::size_t k = 0; k < station.unknowns.size(); ++k) {
      if (fixed[static_cast<std::size_t>(station.unknowns[k])]) {
        station.coupling.row(static_cast<Index>(k)).setZero();
      }
    }
  }
}

ReducedNormal Reduce(const NormalEquations& normal, double damping) {
  ReducedNormal reduced{Damped(normal.matrix, damping), normal.right};
  for (const NormalEquations::Station& station : normal.stations) {
    const MatrixXd solved =
        geometry::SolveSymmetric(Damped(station.block, damping), station.coupling.transpose());
    reduced.matrix(station.unknowns, station.unknowns) -= station.coupling * solved;
    reduced.right(station.unknowns) -= solved.transpose() * station.right;
  }
  return reduced;
}

NormalStep Solve(const NormalEquations& normal, const MatrixXd& motions, double damping) {
  ReducedNormal reduced = Reduce(normal, damping);
  if (motions.cols() > 0 && normal.right.size() > 0) {
    const double size =
        std::max(reduced.matrix.diagonal().mean(), std::numeric_limits<double>::min());
    reduced.matrix += size * motions * motions.transpose();
  }
  NormalStep step;
  step.shared.setZero(normal.right.size());
  if (normal.right.size() > 0) {
    const VectorXd scale = UnitScale(reduced.matrix);
    const MatrixXd scaled = scale.asDiagonal() * reduced.matrix * scale.asDiagonal();
    const VectorXd right = scale.cwiseProduct(reduced.right);
    const auto solved = geometry::SolvePositive(scaled, right);
    step.shared =
        scale.cwiseProduct(VectorXd(solved ? *solved : geometry::SolveSymmetric(scaled, right)));
    step.decrement = step.shared.dot(normal.right);
  }
  for (const NormalEquations::Station& station : normal.stations) {
    const VectorXd part = step.shared(station.unknowns);
    step.stations.emplace_back(geometry::SolveSymmetric(
        Damped(station.block, damping), station.right - station.coupling.transpose() * part));
    step.decrement += step.stations.back().dot(station.right);
  }
  return step;
}

MatrixXd ScaledInverse(const MatrixXd& matrix, bool& determined) {
  const VectorXd scale = UnitScale(matrix);
  const MatrixXd scaled = scale.asDiagonal() * matrix * scale.asDiagonal();
  const auto inverse =
      scaled.allFinite() ? geometry::SolvePositive(
                               scaled, MatrixXd::Identity(matrix.rows(), matrix.cols()), kSingular)
                         : std::nullopt;
  if (!inverse) {
    determined = false;
    return MatrixXd::Zero(matrix.rows(), matrix.cols());
  }
  return scale.asDiagonal() * *inverse * scale.asDiagonal();
}

StationCovariance CovarianceOf(const NormalEquations::Station& station, const MatrixXd& shared,
                               bool& determined) {
  const MatrixXd block_inverse = ScaledInverse(station.block, determined);
  const MatrixXd gain = block_inverse * station.coupling.transpose();
  StationCovariance covariance;
  covariance.within = shared(station.unknowns, station.unknowns);
  covariance.with = -gain * covariance.within;
  covariance.own = block_inverse - covariance.with * gain.transpose();
  return covariance;
}

Eigen::Matrix2d FittedCovariance(const ObservationRow& row, const NormalEquations::Station& station,
                                 const StationCovariance& covariance) {
  std::vector<Index> columns;
  for (const Index unknown : row.unknowns) {
    const auto at = std::lower_bound(station.unknowns.begin(), station.unknowns.end(), unknown);
    columns.push_back(at - station.unknowns.begin());
  }
  const MatrixXd with = covariance.with(Eigen::all, columns);
  const MatrixXd within = covariance.within(columns, columns);
  const Eigen::Matrix2d cross = row.by_own * with * row.by_shared.transpose();
  return row.by_own * covariance.own * row.by_own.transpose() + cross + cross.transpose() +
         row.by_shared * within * row.by_shared.transpose();
}

}  // namespace trammel::part_alignment
