// Pose of the part and clamping of the camera, from pictures.
#pragma once

#include <Eigen/Core>
#include <array>
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

/// Unknowns beside the pose, which is always one; 7D adds the clamp angle.
struct Unknowns {
  bool clamp_angle = true;
  bool clamp_eccentricity = false;
  bool clamp_tilt = false;
  bool focal_length = false;
  bool camera_offset = false;  ///< taper_from_camera's x, y and z
};

/// A field of InputUncertainty.
struct UncertainInput {
  const char* name;  ///< as in files, ended by its unit
  std::optional<double> InputUncertainty::*size;
  bool Unknowns::*unknown;  ///< if solved for, its size does not count; null: it always counts
  const char* words;        ///< for people
};
inline constexpr std::array<UncertainInput, 7> kUncertainInputs{{
    {"machine_mm", &InputUncertainty::machine_mm, nullptr, "machine's repeatability"},
    {"target_mm", &InputUncertainty::target_mm, nullptr, "targets' places"},
    {"clamp_angle_rad", &InputUncertainty::clamp_angle_rad, &Unknowns::clamp_angle, "clamp angle"},
    {"clamp_eccentricity_mm", &InputUncertainty::clamp_eccentricity_mm,
     &Unknowns::clamp_eccentricity, "clamp eccentricity"},
    {"clamp_tilt_rad", &InputUncertainty::clamp_tilt_rad, &Unknowns::clamp_tilt, "clamp tilt"},
    {"focal_length_mm", &InputUncertainty::focal_length_mm, &Unknowns::focal_length,
     "focal length"},
    {"camera_offset_mm", &InputUncertainty::camera_offset_mm, &Unknowns::camera_offset,
     "camera in its taper"},
}};

struct SolveOptions {
  Unknowns unknowns;
  /// If the residuals contradict their sigmas, excludes (weight 0) and names one wrong target, view
  /// or observation: the only one whose exclusion resolves it.
  bool robust = true;
  /// Upper limit of the weakest direction's uncertainty (k = 1), 0.001 ... 100 mm, as motion of the
  /// targets, due to pixels and machine; beyond it the verdict is cannot_tell. Default: a quarter
  /// of a tight allowance of a raw part (+-1 mm), at k = 2.
  double weakest_limit_mm = 0.25;
  /// Uncertainties beside the pixels', one error for each view, each target, or the whole
  /// measurement. All count in the answer, in chi-square and in the covariance. Those not stated
  /// count with their usual size, machine and targets as the residuals require.
  InputUncertainty inputs;
  /// Covariance of the targets' coordinates, mm², three rows for each in the order of the
  /// measurement's; inputs.target_mm adds to it. Absent: by that alone.
  std::optional<Eigen::MatrixXd> target_covariance;
  /// Covariance of the camera's parameters by its calibration, k = 1; absent: exact but for the
  /// position in its taper (InputUncertainty). Camera parameters solved for do not count.
  std::optional<CameraCovariance> camera_covariance;
};

/// Measured minus projected.
struct AlignmentResidual {
  std::size_t view = 0;
  std::string target;
  double column_px = 0;
  double row_px = 0;
  double sigma_px = 0;  ///< including machine and target errors
  double weight = 1;    ///< 0: taken for wrong and left out
};

/// Rank, and the direction that the views determine least.
struct Observability {
  int unknowns = 0;
  int rank = 0;
  /// Unit vector over the parameters, each scaled to move the part's targets by about 1 mm. The
  /// part's frame is at the middle of the targets, its rotations about the machine's axes.
  Eigen::VectorXd weakest;
  double weakest_sigma_mm = 0;  ///< k = 1 along it; infinite below full rank
  std::string words;            ///< which unknowns are inseparable, and why; empty: none
  std::string advice;           ///< the view that would help
};

/// part, clamping and covariance are valid only with verdict good.
struct Alignment {
  Verdict verdict = Verdict::kRefused;
  std::string reason;
  geometry::Pose machine_from_part;
  Clamping clamping;
  double focal_length_mm = 0;
  Eigen::Vector3d camera_offset_mm = Eigen::Vector3d::Zero();
  /// Names of rows and columns: x_mm y_mm z_mm alpha_rad beta_rad gamma_rad clamp_angle_rad
  /// clamp_eccentricity_x_mm … clamp_tilt_x_rad … focal_length_mm camera_offset_x_mm … . The
  /// covariance contains `inputs` and the covariances of targets and camera. Stated values are
  /// never scaled by the residuals, which are tested instead.
  std::vector<std::string> parameters;
  Eigen::MatrixXd covariance;
  InputUncertainty inputs;                ///< as used, all sizes present
  std::vector<std::string> usual_inputs;  ///< fields of `inputs` that count and were not stated
  std::vector<AlignmentResidual> residuals;
  AdjustmentCheck check;          ///< residuals
  double residual_rms_sigma = 0;  ///< per degree of freedom: 1 where the stated sigmas hold
  double chi_square = 0;
  int degrees_of_freedom = 0;  ///< 0: nothing checks the answer
  /// Limits of chi-square, exceeded by 1 in 10,000 on either side.
  double chi_square_low = 0;
  double chi_square_high = 0;
  Observability observability;
  int iterations = 0;
  std::vector<std::string> notices;
};

/// Solves for the part's pose. Errors (kInput): numbers that are not finite, unknown or doubled
/// target ids, a pixel outside the picture, sigma <= 0, a matrix that is no rotation, an invalid
/// camera. A verdict reports what the views do not determine.
///
/// No guess is needed: the part may have any rotation. The clamp angle is searched near 0 first,
/// and all around if nothing fits there. Accuracy: the truth to 1e-9 mm and 1e-12 rad from
/// observations without noise (solve_test).
[[nodiscard]] Result<Alignment> Solve(const Measurement& measurement, const SolveOptions& options);

/// Returns the measurement's camera with its solved parameters. REQUIRES verdict good, as all
/// below.
[[nodiscard]] Camera SolvedCamera(const Measurement& measurement, const Alignment& alignment);

/// Returns a target's pixel (column, row) in a view by the solution; absent outside the picture.
[[nodiscard]] std::optional<Eigen::Vector2d> ImageOf(const Measurement& measurement,
                                                     const Alignment& alignment, const View& view,
                                                     const PartTarget& target);

/// Range along the camera's axis, in mm.
struct DistanceRange {
  double nearest_mm = 0;
  double farthest_mm = 0;
};

/// Returns the nearest and farthest distance of observed targets; 0 without any.
[[nodiscard]] DistanceRange SeenDistances(const Measurement& measurement,
                                          const Alignment& alignment);

/// Returns the part's target with this id, or null.
[[nodiscard]] const PartTarget* FindTarget(const Measurement& measurement, const std::string& id);

/// Returns a sentence for each caveat: a camera outside its calibrated distances, or calibrated
/// long ago; inputs that make the part's place less certain than any view should. None unless the
/// verdict is good.
/// @param calibration  absent: unknown, without a caveat
/// @param today        YYYY-MM-DD
[[nodiscard]] std::vector<std::string> Caveats(const Measurement& measurement,
                                               const SolveOptions& options,
                                               const Alignment& alignment,
                                               const std::optional<CalibrationRecord>& calibration,
                                               std::string_view today);

}  // namespace trammel::part_alignment
