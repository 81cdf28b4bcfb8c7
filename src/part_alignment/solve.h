// Where the part is and how the camera is clamped, from pictures.
#pragma once

#include <Eigen/Core>
#include <cstddef>
#include <string>
#include <vector>

#include "base/measured.h"
#include "base/result.h"
#include "part_alignment/measurement.h"

namespace trammel::part_alignment {

/// What is solved for. The pose always; 7D adds the clamp angle.
struct Unknowns {
  bool clamp_angle = true;
  bool clamp_eccentricity = false;
  bool clamp_tilt = false;
  bool focal_length = false;
  bool camera_offset = false;  ///< of taper_from_camera, x and y and z
};

enum class SolveMethod { kCeres, kGaussNewton };

struct SolveOptions {
  Unknowns unknowns;
  SolveMethod method = SolveMethod::kCeres;
  bool robust = true;  ///< a wrong target is left out by its weight (Ceres only) and named
};

/// Measured minus projected.
struct AlignmentResidual {
  std::size_t view = 0;
  std::string target;
  double column_px = 0;
  double row_px = 0;
  double sigma_px = 0;
  double weight = 1;  ///< in 0 … 1; near 0: taken for wrong
};

/// Rank and the direction that the views tell least about.
struct Observability {
  int unknowns = 0;
  int rank = 0;
  /// Unit vector over the parameters, each scaled to what moves the part's targets by about 1 mm.
  Eigen::VectorXd weakest;
  double weakest_sigma_mm = 0;  ///< k = 1 along it; infinite below full rank
  std::string words;            ///< what cannot be told from what, and why
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
  /// Of covariance, rows and columns: x_mm y_mm z_mm alpha_rad beta_rad gamma_rad clamp_angle_rad …
  std::vector<std::string> parameters;
  Eigen::MatrixXd covariance;
  std::vector<AlignmentResidual> residuals;
  double residual_rms_sigma = 0;  ///< 1 where the stated sigmas hold
  Observability observability;
  int iterations = 0;
  std::vector<std::string> notices;
};

/// Errors (kInput): numbers that are not finite, unknown or doubled target ids, sigma <= 0, a
/// matrix that is no rotation, a camera that cannot be. What the views cannot determine is a
/// verdict.
[[nodiscard]] Result<Alignment> Solve(const Measurement& measurement, const SolveOptions& options);

}  // namespace trammel::part_alignment
