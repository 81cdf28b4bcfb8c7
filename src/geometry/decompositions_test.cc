#include "geometry/decompositions.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <utility>

#include "geometry/euler.h"
#include "geometry/linear_systems.h"

namespace trammel::geometry {
namespace {

constexpr double kRounding = 1e-14;

Eigen::MatrixXd Numbers(int rows, int columns) {
  Eigen::MatrixXd matrix(rows, columns);
  for (int i = 0; i < rows; ++i) {
    for (int j = 0; j < columns; ++j) matrix(i, j) = std::sin(1 + 3.7 * i + 1.3 * j * j);
  }
  return matrix;
}

void ExpectIdentity(const Eigen::MatrixXd& matrix) {
  EXPECT_LT((matrix - Eigen::MatrixXd::Identity(matrix.rows(), matrix.cols())).norm(), kRounding);
}

TEST(Decompositions, OrthogonalTimesTriangularIsTheMatrixInEveryShape) {
  for (const auto& [rows, columns] : {std::pair{5, 3}, {4, 4}, {3, 5}, {1, 3}}) {
    const Eigen::MatrixXd matrix = Numbers(rows, columns);
    const PivotedOrthogonal of = DecomposePivoted(matrix);
    ASSERT_EQ(of.r.rows(), std::min(rows, columns));
    ExpectIdentity(of.q.transpose() * of.q);
    const Eigen::MatrixXd product = of.q * of.r;
    for (int k = 0; k < columns; ++k) {
      EXPECT_LT((product.col(k) - matrix.col(of.order[k])).norm(), kRounding);
    }
    for (int i = 1; i < of.r.rows(); ++i) {
      EXPECT_GE(std::abs(of.r(i - 1, i - 1)), std::abs(of.r(i, i)));
      EXPECT_EQ(of.r(i, 0), 0);
    }
    if (rows < columns) continue;
    const OrthogonalTriangular in_order = DecomposeOrthogonal(matrix);
    EXPECT_LT((in_order.q * in_order.r - matrix).norm(), kRounding);
    ExpectIdentity(in_order.q.transpose() * in_order.q);
    EXPECT_EQ(in_order.r(columns - 1, 0), 0);
  }
}

TEST(LinearSystems, APositiveMatrixIsSolvedAndOneThatIsNotIsSaid) {
  const Eigen::MatrixXd numbers = Numbers(4, 4);
  const Eigen::MatrixXd matrix = numbers * numbers.transpose() + Eigen::MatrixXd::Identity(4, 4);
  const Eigen::VectorXd right = numbers.col(0);
  const auto solved = SolvePositive(matrix, right);
  ASSERT_TRUE(solved);
  EXPECT_LT((matrix * *solved - right).norm(), 10 * kRounding);
  EXPECT_LT((SolveSmallSymmetric(matrix, right) - *solved).norm(), 10 * kRounding);
  EXPECT_FALSE(SolvePositive(-matrix, right));
  EXPECT_FALSE(SolvePositive(matrix, right, 1e9));
}

TEST(Decompositions, ACovariancesRootGivesItBackWhateverItsUnits) {
  const Eigen::MatrixXd numbers = Numbers(4, 4);
  const Eigen::Vector4d units(1e-9, 1, 1e6, 1);
  Eigen::MatrixXd covariance =
      units.asDiagonal() * numbers * numbers.transpose() * units.asDiagonal();
  covariance.row(3).setZero();  // known exactly
  covariance.col(3).setZero();
  const Eigen::MatrixXd root = CovarianceRoot(covariance);
  const Eigen::MatrixXd again = root * root.transpose();
  for (int i = 0; i < 4; ++i) {
    for (int k = 0; k < 4; ++k) {
      EXPECT_NEAR(again(i, k), covariance(i, k), kRounding * 100 * units[i] * units[k]);
    }
  }
}

TEST(Decompositions, ACovariancesRootLeavesOutWhatIsBelowZeroByChance) {
  const Eigen::MatrixXd root = CovarianceRoot(Eigen::Vector3d(4, -0.1, 9).asDiagonal());
  const Eigen::MatrixXd again = root * root.transpose();
  EXPECT_LT((again - Eigen::MatrixXd(Eigen::Vector3d(4, 0, 9).asDiagonal())).norm(),
            kRounding * 10);
}

TEST(Decompositions, AnErrorIsCountedInTheSigmasOfItsDirection) {
  const Eigen::Matrix3d turn = RotationFromVector({0.3, -0.8, 0.5});
  const Eigen::Vector3d sigmas(1e-3, 2, 50);
  const Eigen::MatrixXd covariance = turn * sigmas.cwiseAbs2().asDiagonal() * turn.transpose();
  const Eigen::VectorXd error = turn * Eigen::Vector3d(3e-3, 2, 100);
  EXPECT_NEAR(SquaredMahalanobisDistance(covariance, error), 9 + 1 + 4, 1e-5);
}

TEST(Decompositions, ACompletionIsOrthogonalToTheColumns) {
  const Eigen::MatrixXd columns = Numbers(6, 4) + Eigen::MatrixXd::Identity(6, 4);
  const Eigen::MatrixXd q = OrthogonalCompletion(columns);
  ExpectIdentity(q.transpose() * q);
  EXPECT_LT((columns.transpose() * q.rightCols(2)).norm(), 10 * kRounding);
}

}  // namespace
}  // namespace trammel::geometry
