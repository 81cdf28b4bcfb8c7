// Repeated calibrations with repeated measurements of a part that stays: what
// u_ip is made from.
#pragma once

#include <span>
#include <string>
#include <vector>

#include "part_alignment/budget/budget.h"
#include "part_alignment/pose/measurement.h"
#include "part_alignment/pose/solve.h"

namespace trammel::part_alignment {

struct RepeatedTarget {
  std::string id;
  CrossedScatter scatter;  ///< of its machine coordinates
};

struct RepeatedAlignments {
  std::vector<RepeatedTarget> targets;
  /// Of one calibration and one measurement: root mean square over the targets.
  Eigen::Vector3d single_mm = Eigen::Vector3d::Zero();
  /// Of the part's motion about its origin and axes (BudgetScene::motion_covariance), of one
  /// calibration and one measurement.
  Eigen::Matrix<double, 6, 6> motion_covariance = Eigen::Matrix<double, 6, 6>::Zero();
  /// The standard deviation of all values, as the literature takes it, over the
  /// targets.
  Eigen::Vector3d joint_mm = Eigen::Vector3d::Zero();
};

/// Solves every measurement with every camera and splits the scatter of each
/// target's machine coordinates. The part must not have been moved in between;
/// the cameras in the measurements are not used. Errors (kInput): fewer than
/// two of either, measurements of different targets, those of Solve;
/// (kMeasurement): a solution whose verdict is not good, with its reason.
[[nodiscard]] Result<RepeatedAlignments> RepeatAlignments(std::span<const Camera> cameras,
                                                          std::span<const Measurement> measurements,
                                                          const SolveOptions& options);

}  // namespace trammel::part_alignment
