// Small dense non-linear least squares.
#pragma once

#include <Eigen/Core>
#include <functional>

namespace trammel::part_alignment {

/// Function that computes residuals at `x` and, if `jacobian` is given, their derivatives
/// (residuals by parameters). False where the model has no value at `x`.
using ResidualFunction = std::function<bool(const Eigen::VectorXd& x, Eigen::VectorXd& residuals,
                                            Eigen::MatrixXd* jacobian)>;

struct LeastSquaresFit {
  bool converged = false;
  int iterations = 0;
  Eigen::VectorXd x;
  Eigen::VectorXd residuals;  ///< at x
  Eigen::MatrixXd jacobian;   ///< at x
};

/// Fits by Minimise (descent.h) with parameters of any size. Ends when a step changes the residuals
/// by less than 1e-10 of their unit altogether. Accuracy: that of the residuals; quadratic where
/// they vanish.
[[nodiscard]] LeastSquaresFit FitLeastSquares(const ResidualFunction& function,
                                              Eigen::VectorXd start);

/// (JᵀJ)⁻¹ by way of a singular value decomposition of the column-scaled Jacobian: the covariance
/// where the residuals are in units of their standard deviation.
struct JacobianInverse {
  Eigen::MatrixXd covariance;
  /// Least determined combination of the parameters, of length 1, with the Jacobian's columns
  /// scaled to length 1.
  Eigen::VectorXd weakest;
};
[[nodiscard]] JacobianInverse InvertNormal(const Eigen::MatrixXd& jacobian);

}  // namespace trammel::part_alignment
