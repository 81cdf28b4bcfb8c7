// Linear least squares with a covariance from the fit's own residuals.
#pragma once

#include <Eigen/Core>
#include <optional>

#include "base/measured.h"

namespace trammel::pressure_advance {

struct LinearFit {
  Eigen::VectorXd value;
  Eigen::MatrixXd covariance;  ///< scaled by the residuals' variance
  double residual = 0;         ///< their standard deviation, in the observations' unit
  double degrees_of_freedom = 0;
};

/// Fits design · value = observed with equal weights.
/// @returns nothing where fewer than three observations are left over, or where the columns, each
/// brought to length 1, do not determine every value (condition above 1e5: the observations do not
/// vary in what that column stands for).
[[nodiscard]] std::optional<LinearFit> FitLinear(const Eigen::MatrixXd& design,
                                                 const Eigen::VectorXd& observed);

/// A function's variance by its gradient over the fit's values.
[[nodiscard]] double Variance(const LinearFit& fit, const Eigen::VectorXd& gradient);

/// A value whose uncertainty is of the fit (variance `statistical`, Student's t) and of what no
/// residual shows (variance `systematic`, taken as known: normal).
[[nodiscard]] Measured MeasuredFrom(double value, double statistical, double systematic,
                                    double degrees_of_freedom);

}  // namespace trammel::pressure_advance
