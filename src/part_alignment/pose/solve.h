// Where the part is and how the camera is clamped, from pictures.
#pragma once

#include <Eigen/Core>
#include <cstddef>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "base/measured.h"
#include "base/rejection.h"
#include "base/result.h"
#include "part_alignment/camera/calibration_record.h"
#include "part_alignment/camera/camera.h"
#include "part_alignment/pose/measurement.h"

namespace trammel::part_alignment {

/// What is solved for. The pose always; 7D adds the clamp angle.
struct Unknowns {
  bool clamp_angle = true;
  bool clamp_eccentricity = false;
  bool clamp_tilt = false;
  bool focal_length = false;
  bool camera_offset = false;  ///< of taper_from_camera, x and y and z
};

struct SolveOptions {
  Unknowns unknowns;
  /// Where the residuals contradict their sigmas, one wrong target, view or observation is left out
  /// (weight 0) and named, if leaving it out, and nothing else, puts things right.
  bool robust = true;
  /// The most that the weakest direction may be uncertain by (k = 1), 0.001 ... 100 mm, moving the
  /// targets, by what pixels and machine leave; beyond it the verdict is cannot_tell.
  /// Default: a quarter of a tight allowance of a raw part (+-1 mm), at k = 2.
  double weakest_limit_mm = 0.25;
  /// What is uncertain beside the pixels, each as what it is: one error for each view, each target,
  /// the whole measurement. All of it counts in the answer, in chi-square and in the covariance;
  /// what is not stated counts with its usual size, machine and targets as the residuals ask for.
  InputUncertainty inputs;
  /// Of the targets' coordinates together, mm², three rows for each in the order of the
  /// measurement's; inputs.target_mm comes on top. Absent: as that says.
  std::optional<Eigen::MatrixXd> target_covariance;
  /// Of the camera's parameters by its calibration, k = 1; absent: exact but for the place in its
  /// taper (InputUncertainty). What is solved for of the camera does not count.
  std::optional<CameraCovariance> camera_covariance;
};

/// Measured minus projected.
struct AlignmentResidual {
  std::size_t view = 0;
  std::string target;
  double column_px = 0;
  double row_px = 0;
  double sigma_px = 0;  ///< with the share of machine and targets
  double weight = 1;    ///< 0: taken for wrong and left out
};

/// Rank and the direction that the views tell least about.
struct Observability {
  int unknowns = 0;
  int rank = 0;
  /// Unit vector over the parameters, each scaled to what moves the part's targets by about 1 mm;
  /// the part's frame taken in the middle of the targets, its rotations about the machine's axes.
  Eigen::VectorXd weakest;
  double weakest_sigma_mm = 0;  ///< k = 1 along it; infinite below full rank
  std::string words;            ///< what cannot be told from what, and why; empty: all is told
  std::string advice;           ///< the view that would help
};

/// part, clamping and covariance are meant only with verdict good.
struct Alignment {
  Verdict verdict = Verdict::kRefused;
  std::string reason;
  geometry::Pose machine_from_part;
  Clamping clamping;
  double focal_length_mm = 0;
  Eigen::Vector3d camera_offset_mm = Eigen::Vector3d::Zero();
  /// Of covariance, rows and columns: x_mm y_mm z_mm alpha_rad beta_rad gamma_rad clamp_angle_rad
  /// clamp_eccentricity_x_mm … clamp_tilt_x_rad … focal_length_mm camera_offset_x_mm …
  /// All that `inputs` and the covariances of targets and camera hold is in it; what is stated is
  /// never scaled by the residuals, which are judged instead.
  std::vector<std::string> parameters;
  Eigen::MatrixXd covariance;
  InputUncertainty inputs;                ///< as they counted, all sizes present
  std::vector<std::string> usual_inputs;  ///< fields of `inputs` that count and were not stated
  std::vector<AlignmentResidual> residuals;
  AdjustmentCheck check;          ///< of the residuals
  double residual_rms_sigma = 0;  ///< per degree of freedom: 1 where the stated sigmas hold
  double chi_square = 0;
  int degrees_of_freedom = 0;  ///< 0: nothing checks the answer
  /// What chi-square stays within but for 1 in 10,000 on either side.
  double chi_square_low = 0;
  double chi_square_high = 0;
  Observability observability;
  int iterations = 0;
  std::vector<std::string> notices;
};

/// Errors (kInput): numbers that are not finite, unknown or doubled target ids, a pixel outside the
/// picture, sigma <= 0, a matrix that is no rotation, a camera that cannot be. What the views
/// cannot determine is a verdict.
///
/// No guess is needed: the part may be turned anyhow. The clamp angle is looked for near 0 first
/// and all around where nothing fits there. Accuracy: the truth to 1e-9 mm and 1e-12 rad from
/// observations without noise (solve_test).
[[nodiscard]] Result<Alignment> Solve(const Measurement& measurement, const SolveOptions& options);

/// The measurement's camera with what was solved for of it. REQUIRES verdict good, as all below.
[[nodiscard]] Camera SolvedCamera(const Measurement& measurement, const Alignment& alignment);

/// Where the solution has a target in a view, (column, row) in px; absent outside the picture.
[[nodiscard]] std::optional<Eigen::Vector2d> ImageOf(const Measurement& measurement,
                                                     const Alignment& alignment, const View& view,
                                                     const PartTarget& target);

/// Along the camera's axis, in mm.
struct DistanceRange {
  double nearest_mm = 0;
  double farthest_mm = 0;
};

/// From how near and how far the targets were seen that were observed; 0 where none was.
[[nodiscard]] DistanceRange SeenDistances(const Measurement& measurement,
                                          const Alignment& alignment);

/// The part's target with this id; none where there is none.
[[nodiscard]] const PartTarget* FindTarget(const Measurement& measurement, const std::string& id);

/// A sentence for each: a camera used outside the distances it was calibrated at, or calibrated
/// long ago; inputs that leave the part's place less certain than any view should. None unless the
/// verdict is good.
/// @param calibration  absent: nothing is known of it, and nothing said
/// @param today        YYYY-MM-DD
[[nodiscard]] std::vector<std::string> Caveats(const Measurement& measurement,
                                               const SolveOptions& options,
                                               const Alignment& alignment,
                                               const std::optional<CalibrationRecord>& calibration,
                                               std::string_view today);

}  // namespace trammel::part_alignment
