#include "geometry/decompositions.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <utility>

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

TEST(Decompositions, SingularValuesMakeUpTheMatrixInEveryShape) {
  for (const auto& [rows, columns] : {std::pair{5, 3}, {3, 5}, {4, 4}, {1, 3}}) {
    const Eigen::MatrixXd matrix = Numbers(rows, columns);
    const SingularValues of = DecomposeSingular(matrix);
    ASSERT_EQ(of.values.size(), std::min(rows, columns));
    EXPECT_LT((of.u * of.values.asDiagonal() * of.v.transpose() - matrix).norm(), kRounding);
    ExpectIdentity(of.u.transpose() * of.u);
    ExpectIdentity(of.v.transpose() * of.v);
    for (int i = 1; i < of.values.size(); ++i) EXPECT_GE(of.values[i - 1], of.values[i]);
  }
}

TEST(Decompositions, EigenvectorsOfASymmetricMatrixMakeItUpFromTheSmallestOn) {
  const Eigen::MatrixXd numbers = Numbers(6, 6);
  const Eigen::MatrixXd matrix = numbers + numbers.transpose();
  const SymmetricEigen of = DecomposeSymmetric(matrix);
  EXPECT_LT((of.vectors * of.values.asDiagonal() * of.vectors.transpose() - matrix).norm(),
            10 * kRounding);
  ExpectIdentity(of.vectors.transpose() * of.vectors);
  EXPECT_LT((SymmetricEigenvalues(matrix) - of.values).norm(), 10 * kRounding);
  for (int i = 1; i < of.values.size(); ++i) EXPECT_LE(of.values[i - 1], of.values[i]);
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

}  // namespace
}  // namespace trammel::geometry
