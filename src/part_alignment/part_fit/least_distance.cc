#include "part_alignment/part_fit/least_distance.h"

#include <algorithm>
#include <cmath>

#include "geometry/linear_systems.h"

namespace trammel::part_alignment {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

VectorXd SolveFor(const MatrixXd& e, const VectorXd& f, const std::vector<Index>& columns) {
  MatrixXd picked(e.rows(), static_cast<Index>(columns.size()));
  for (std::size_t k = 0; k < columns.size(); ++k) {
    picked.col(static_cast<Index>(k)) = e.col(columns[k]);
  }
  return geometry::SolveLeastSquares(picked, f);
}

// min |e u - f|, u >= 0: variables enter one by one and leave where they would become negative.
VectorXd NonNegative(const MatrixXd& e, const VectorXd& f) {
  VectorXd u = VectorXd::Zero(e.cols());
  std::vector<Index> passive;
  const Index most_rounds = 3 * e.cols() + 100;
  constexpr double kEnough = 1e-12;
  for (Index round = 0; round < most_rounds; ++round) {
    VectorXd gradient = e.transpose() * (f - e * u);
    for (const Index i : passive) gradient[i] = 0;
    Index enters = 0;
    if (!(gradient.maxCoeff(&enters) > kEnough) || std::ssize(passive) == e.rows()) break;
    passive.push_back(enters);
    while (!passive.empty()) {
      const VectorXd wanted = SolveFor(e, f, passive);
      double step = 1;
      for (std::size_t k = 0; k < passive.size(); ++k) {
        const double from = u[passive[k]];
        const double to = wanted[static_cast<Index>(k)];
        if (to <= 0) step = std::min(step, from / (from - to));
      }
      if (!(step >= 0)) step = 0;
      for (std::size_t k = 0; k < passive.size(); ++k) {
        double& value = u[passive[k]];
        value += step * (wanted[static_cast<Index>(k)] - value);
      }
      if (step >= 1) break;
      std::erase_if(passive, [&u](Index i) {
        constexpr double kGone = 1e-14;
        if (u[i] > kGone) return false;
        u[i] = 0;
        return true;
      });
    }
  }
  return u;
}

}  // namespace

std::optional<LeastDistance> SolveLeastDistance(const MatrixXd& rows, const VectorXd& right) {
  const Index n = rows.cols();
  // Rows of one size, right sides of about 1: the test for infeasibility is one of pure numbers.
  const double size = std::max(right.cwiseAbs().maxCoeff(), 1e-300);
  MatrixXd e(n + 1, rows.rows());
  e.topRows(n) = rows.transpose();
  e.row(n) = right.transpose() / size;
  VectorXd f = VectorXd::Zero(n + 1);
  f[n] = 1;
  const VectorXd u = NonNegative(e, f);
  const VectorXd residual = e * u - f;
  constexpr double kInfeasible = 1e-9;
  if (!(residual.norm() > kInfeasible) || !(std::abs(residual[n]) > kInfeasible * kInfeasible)) {
    return std::nullopt;
  }
  LeastDistance nearest;
  nearest.point = -residual.head(n) / residual[n] * size;
  constexpr double kHolds = 1e-7;
  if (!((rows * nearest.point - right).minCoeff() > -kHolds * size)) return std::nullopt;
  for (Index i = 0; i < u.size(); ++i) {
    if (u[i] > 0) nearest.binding.push_back(i);
  }
  return nearest;
}

}  // namespace trammel::part_alignment
