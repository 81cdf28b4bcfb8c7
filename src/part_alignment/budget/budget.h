// Computes the uncertainty of any point of an aligned part: contributors, their sum, and a
// simulation as a check.
#pragma once

#include <Eigen/Core>
#include <array>
#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "base/random.h"
#include "base/result.h"

namespace trammel::part_alignment {

/// Part, targets and measurement of a budget. Lengths in the part's frame, k = 1.
struct BudgetScene {
  std::vector<Eigen::Vector3d> targets_mm;
  /// Uncertainty of each target's machine coordinates (u_ip's root): calibration, machine, picture.
  Eigen::Vector3d target_sigma_mm = Eigen::Vector3d::Zero();
  /// Repeatability of the pose about the part's origin: x y z in mm, alpha beta gamma in rad. Zero
  /// if target_sigma_mm includes it already; the literature adds both.
  Eigen::Matrix<double, 6, 1> pose_sigma = Eigen::Matrix<double, 6, 1>::Zero();
  /// Number of measurements and calibrations behind the two above; 0: taken as known.
  int repeats = 10;
  /// Box of points that the budget covers.
  Eigen::Vector3d low_mm = Eigen::Vector3d::Zero();
  Eigen::Vector3d high_mm = Eigen::Vector3d::Zero();
  /// Point fixed when the part's temperature differs (u_it), rectangular, and steel.
  Eigen::Vector3d still_mm = Eigen::Vector3d::Zero();
  double temperature_half_width_k = 1;
  double expansion_per_k = 11e-6;
  /// Length error of the measurement out of the machine (u_out), constant + part of the box's edge
  /// along the axis: 50 µm + 20 µm/m is typical of portable photogrammetry (Luhmann et al. 2011).
  double length_error_mm = 0.05;
  double length_error_per_mm = 20e-6;
  /// Measured standard uncertainty, instead of the two above.
  std::optional<Eigen::Vector3d> out_sigma_mm;
};

/// Budget of one axis at the box's point of largest uncertainty. Standard uncertainties, mm, k = 1.
struct AxisBudget {
  double u_out_mm = 0;
  double u_ip_mm = 0;
  double u_it_mm = 0;
  double combined_mm = 0;
  double expanded_mm = 0;         ///< k = 2
  double degrees_of_freedom = 0;  ///< effective, Welch-Satterthwaite; infinite where all known
  double coverage_factor = 0;     ///< 95 % of Student's t of so many
  Eigen::Vector3d at_mm = Eigen::Vector3d::Zero();
  double simulated_mm = 0;           ///< standard deviation of the simulation there
  double simulated_expanded_mm = 0;  ///< half of its symmetric 95 % interval
};

struct Budget {
  std::array<AxisBudget, 3> axes;
  int trials = 0;
};

/// Computes the linear propagation (GUM) and, with `trials` above 0, a simulation (GUM supplement
/// 1). The pose follows from the targets by weighted least squares. u_it is rectangular over ± the
/// half-width, u_out rectangular over ± the length error (LME / sqrt(3)).
/// Errors (kInput): fewer than three targets or all in one line, sigmas that are not above 0,
/// numbers that are not finite, an empty box, more than ten million trials.
/// Accuracy: simulation and linear sum agree to the simulation's own scatter (budget_test).
[[nodiscard]] Result<Budget> MakeBudget(const BudgetScene& scene, int trials, Random& random);

/// Length measured out of the machine, with its calibrated value.
struct MeasuredLength {
  double calibrated_mm = 0;
  double measured_mm = 0;
};
struct LengthErrors {
  double largest_mm = 0;  ///< largest absolute error
  std::size_t worst = 0;  ///< index of the worst
  bool within = false;    ///< every error within its limit
  std::vector<std::string> notices;
};
/// Checks the length measurement error after VDI/VDE 2634 part 1: errors against constant + slope ·
/// length. A test has at least five lengths along each of at least seven lines; a notice reports
/// fewer.
/// Errors (kInput): no length, a length that is not finite or not above 0, a negative limit.
[[nodiscard]] Result<LengthErrors> JudgeLengths(std::span<const MeasuredLength> lengths,
                                                double constant_mm, double per_mm);

/// Capability by Berndt's rule. T is the tolerance's full width, upper minus lower limit; with the
/// half-width the ratio doubles.
struct Capability {
  double ratio = 0;  ///< U / T
  double ratio_of_half_width = 0;
  bool capable = false;  ///< ratio at most the limit
};
/// REQUIRES upper_mm > lower_mm, most_ratio > 0.
[[nodiscard]] Capability JudgeCapability(double expanded_mm, double lower_mm, double upper_mm,
                                         double max_ratio = 0.2);

/// Small motion of the part: x y z in mm at its origin, rotations about its axes in rad.
struct BudgetTerms {
  Eigen::Matrix<double, 6, 6> motion_covariance;
  Eigen::MatrixXd motion_from_targets;  ///< (6, 3 · targets): the weighted fit of their errors
};

/// Errors (kInput) as in MakeBudget.
[[nodiscard]] Result<BudgetTerms> TermsOf(const BudgetScene& scene);

/// Computes d(point) / d(motion).
[[nodiscard]] Eigen::Matrix<double, 3, 6> MotionAt(const Eigen::Vector3d& point_mm);

/// Computes u_it at a point, per axis.
[[nodiscard]] Eigen::Vector3d ExpansionSigma(const BudgetScene& scene,
                                             const Eigen::Vector3d& point_mm);
/// Computes u_out per axis.
[[nodiscard]] Eigen::Vector3d OutSigma(const BudgetScene& scene);

/// Draws one sample each of: the motion of targets and pose, the relative expansion, and an error
/// out of the machine along an axis (rectangular, or normal if u_out was measured).
[[nodiscard]] Eigen::Matrix<double, 6, 1> DrawMotion(const BudgetScene& scene,
                                                     const BudgetTerms& terms, Random& random);
[[nodiscard]] double DrawStrain(const BudgetScene& scene, Random& random);
[[nodiscard]] double DrawOut(const BudgetScene& scene, int axis, Random& random);

}  // namespace trammel::part_alignment
