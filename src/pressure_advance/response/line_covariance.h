// How the readings of one line go together.
#pragma once

#include <Eigen/Core>
#include <vector>

namespace trammel::pressure_advance {

/// Covariance of readings along a line: each reading's own variance, filament that moves to the
/// next reading, a flow that wanders with a correlation that falls off exponentially, and causes
/// common to the line. All takes a time that grows as the number of readings.
class LineCovariance {
 public:
  struct Terms {
    Eigen::VectorXd own;          ///< variance of each reading, > 0
    Eigen::VectorXd between;      ///< variance of what moves to the next reading; n - 1 values
    Eigen::VectorXd wander;       ///< of the wandering flow at each reading, 1 sigma
    Eigen::VectorXd correlation;  ///< of that with the next reading's, [0, 1); n - 1 values
    Eigen::MatrixXd common;       ///< of each common cause, 1 sigma; n x causes, at least one
  };
  LineCovariance() = default;
  explicit LineCovariance(const Terms& terms);

  /// @returns the inverse covariance times columns, n x any
  [[nodiscard]] Eigen::MatrixXd Solve(const Eigen::MatrixXd& columns) const;
  [[nodiscard]] double LogDeterminant() const { return log_determinant_; }
  [[nodiscard]] Eigen::VectorXd InverseDiagonal() const;

 private:
  // Of a reading and of what its flow wanders by.
  struct Pair {
    double reading = 0, flow = 0;
  };
  struct Block {
    double reading = 0, both = 0, flow = 0;  // symmetric

    [[nodiscard]] Pair Times(const Pair& pair) const;
    [[nodiscard]] double Determinant() const { return reading * flow - both * both; }
    [[nodiscard]] Block Inverse() const;
  };
  [[nodiscard]] Eigen::MatrixXd SolveWithoutCommon(const Eigen::MatrixXd& columns) const;

  std::vector<Block> inverse_pivot_;  // of a block-tridiagonal matrix (see the constructor)
  std::vector<Pair> beside_;          // diagonals of the blocks beside the diagonal
  // Of each common cause u, taken in one after the other: C⁻¹ u / (1 + u C⁻¹ u)^1/2 of those
  // before.
  Eigen::MatrixXd weighed_;
  double log_determinant_ = 0;
};

}  // namespace trammel::pressure_advance
