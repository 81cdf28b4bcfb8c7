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

}  // namespace
}  // namespace trammel::geometry
