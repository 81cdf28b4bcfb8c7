#include "pressure_advance/response/line_covariance.h"

#include <gtest/gtest.h>

#include <Eigen/Core>
#include <cmath>

#include "base/random.h"
#include "geometry/linear_systems.h"

namespace trammel::pressure_advance {
namespace {

using Eigen::Index, Eigen::MatrixXd, Eigen::VectorXd;

LineCovariance::Terms Draw(Random& random, Index n, Index causes) {
  const auto any = [&](double lo, double hi, Index rows) {
    return VectorXd(VectorXd::NullaryExpr(rows, [&] { return random.Uniform(lo, hi); }));
  };
  LineCovariance::Terms terms{any(1e-4, 1e-2, n), any(0, 1e-2, n - 1), any(0, 0.05, n),
                              any(0, 0.99, n - 1), MatrixXd(n, causes)};
  for (Index k = 0; k < causes; ++k) terms.common.col(k) = any(-0.3, 0.3, n);
  return terms;
}

MatrixXd Dense(const LineCovariance::Terms& terms) {
  const Index n = terms.own.size();
  MatrixXd dense = terms.own.asDiagonal();
  for (Index i = 0; i + 1 < n; ++i) {
    dense(i, i) += terms.between(i);
    dense(i + 1, i + 1) += terms.between(i);
    dense(i, i + 1) -= terms.between(i);
    dense(i + 1, i) -= terms.between(i);
  }
  for (Index i = 0; i < n; ++i) {
    double together = 1;
    for (Index j = i; j < n; ++j) {
      const double both = terms.wander(i) * terms.wander(j) * together;
      dense(i, j) += both;
      if (j != i) dense(j, i) += both;
      if (j + 1 < n) together *= terms.correlation(j);
    }
  }
  return dense + terms.common * terms.common.transpose();
}

TEST(LineCovariance, SolvesAsTheWholeMatrixDoes) {
  Random random(11);
  for (const Index n : {Index{1}, Index{2}, Index{8}, Index{60}}) {
    for (const Index causes : {Index{1}, Index{3}}) {
      const LineCovariance::Terms terms = Draw(random, n, causes);
      const LineCovariance covariance(terms);
      const MatrixXd dense = Dense(terms);
      const MatrixXd columns = MatrixXd::NullaryExpr(n, 4, [&] { return random.Normal(); });
      const MatrixXd expected = geometry::SolveSymmetric(dense, columns);
      EXPECT_LT((covariance.Solve(columns) - expected).norm(), 1e-7 * expected.norm());
      const VectorXd diagonal = geometry::Inverse(dense).diagonal();
      EXPECT_LT((covariance.InverseDiagonal() - diagonal).norm(), 1e-7 * diagonal.norm());
      const double log_determinant =
          2 * geometry::CholeskyRoot(dense).diagonal().array().log().sum();
      EXPECT_NEAR(covariance.LogDeterminant(), log_determinant, 1e-6 * static_cast<double>(n));
    }
  }
}

}  // namespace
}  // namespace trammel::pressure_advance
