// The terms that a budget and a simulation of it share.
#pragma once

#include <Eigen/Core>

#include "base/random.h"
#include "base/result.h"
#include "part_alignment/budget/budget.h"

namespace trammel::part_alignment {

/// A small motion of the part: x y z in mm at its origin, turns about its axes in rad.
struct BudgetTerms {
  Eigen::Matrix<double, 6, 6> motion_covariance;
  Eigen::MatrixXd motion_from_targets;  ///< (6, 3 · targets): the weighted fit of their errors
};

/// Errors (kInput) as in MakeBudget.
[[nodiscard]] Result<BudgetTerms> TermsOf(const BudgetScene& scene);

/// d(point) / d(motion).
[[nodiscard]] Eigen::Matrix<double, 3, 6> MotionAt(const Eigen::Vector3d& point_mm);

/// u_it at a point, per axis.
[[nodiscard]] Eigen::Vector3d ExpansionSigma(const BudgetScene& scene,
                                             const Eigen::Vector3d& point_mm);
/// u_out per axis.
[[nodiscard]] Eigen::Vector3d OutSigma(const BudgetScene& scene);

/// One draw of each: the motion of targets and pose, the relative expansion, an error out of the
/// machine along an axis (rectangular, or normal where u_out was measured).
[[nodiscard]] Eigen::Matrix<double, 6, 1> DrawMotion(const BudgetScene& scene,
                                                     const BudgetTerms& terms, Random& random);
[[nodiscard]] double DrawStrain(const BudgetScene& scene, Random& random);
[[nodiscard]] double DrawOut(const BudgetScene& scene, int axis, Random& random);

}  // namespace trammel::part_alignment
