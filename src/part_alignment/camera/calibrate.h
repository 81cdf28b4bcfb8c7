// A camera's calibration out of the machine: one target at known places, seen by a camera at rest.
#pragma once

#include <Eigen/Core>
#include <cstddef>
#include <optional>
#include <string>
#include <vector>

#include "base/measured.h"
#include "base/rejection.h"
#include "base/result.h"
#include "part_alignment/camera/camera.h"

namespace trammel::part_alignment {

/// The target's centre in one picture, and where the measuring machine says its tip was.
struct GridView {
  Eigen::Vector3d tip_mm = Eigen::Vector3d::Zero();  ///< in the measuring machine's frame
  double column_px = 0;
  double row_px = 0;
  double sigma_px = 0;  ///< per axis, k = 1
};

/// The measuring machine (CMM) carries the target through a pyramid of places before the camera,
/// whose taper was probed in the same frame.
struct GridMeasurement {
  /// Its size, pitch, convention and side; everything else is measured.
  Camera camera;
  geometry::Pose cmm_from_taper;
  /// Of the probed taper: x y z in mm, alpha beta gamma in rad; k = 1. In every picture the same.
  Eigen::Matrix<double, 6, 1> taper_sigma = Eigen::Matrix<double, 6, 1>::Zero();
  /// From the tip to the target's centre, in the measuring machine's frame.
  Eigen::Vector3d target_from_tip_mm = Eigen::Vector3d::Zero();
  Eigen::Vector3d target_from_tip_sigma_mm = Eigen::Vector3d::Zero();
  /// Of the measuring machine's places, per axis, anew in each: k = 1.
  double position_sigma_mm = 0;
  std::vector<GridView> views;
};

struct CalibrateOptions {
  /// Residuals beyond this many stated sigmas (root mean square) refuse the calibration.
  double most_residual_sigma = 3;
  /// A focal length less certain than this fraction of itself is not determined, k = 1.
  double most_focal_uncertainty = 1e-3;
};

/// Measured minus projected.
struct GridResidual {
  double column_px = 0;
  double row_px = 0;
  double sigma_px = 0;  ///< with the measuring machine's own uncertainty
  bool used = true;     ///< false: taken for wrong and left out
};

/// How well the rest of the grid foretells one of its planes.
struct HeldOutPlane {
  double distance_mm = 0;  ///< mean, along the camera's axis
  int views = 0;
  double rms_px = 0;     ///< per axis
  double rms_sigma = 0;  ///< in units of what both uncertainties let expect: about 1
};

/// camera and its covariances are meant only with verdict good.
struct CameraCalibration {
  Verdict verdict = Verdict::kRefused;
  std::string reason;
  Camera camera;
  /// k = 1, in the order of kCameraParameterNames; with the taper's and the target's uncertainty.
  CameraCovariance covariance = CameraCovariance::Zero();
  /// Without those two: what another grid in the same set-up would scatter by.
  CameraCovariance scatter = CameraCovariance::Zero();
  double residual_rms_px = 0;     ///< per axis
  double residual_rms_sigma = 0;  ///< 1 where the stated sigmas hold
  int degrees_of_freedom = 0;
  AdjustmentCheck check;
  double nearest_mm = 0;  ///< of the grid, along the camera's axis from its origin
  double farthest_mm = 0;
  std::vector<GridResidual> residuals;  ///< one for each view
  std::vector<HeldOutPlane> cross_validation;
  std::vector<std::string> notices;
};

/// Focal length, principal point, distortion and the place of the camera in its taper together. No
/// guess is needed: the first is linear. Where residuals are larger than stated, the covariance
/// grows with their square.
/// Errors (kInput): a camera, sigma or number that cannot be. What the grid does not determine (one
/// plane, too few views), or contradicts (a mirrored picture, residuals beyond reason), is a
/// verdict.
/// Accuracy: exact to 1e-9 px on noise-free grids (calibrate_test).
[[nodiscard]] Result<CameraCalibration> CalibrateCamera(const GridMeasurement& grid,
                                                        const CalibrateOptions& options);

/// What to say where what was seen (`what`: "mark") leaves the picture's corners out; absent where
/// it does not.
/// @param seen_px  the farthest from the principal point
[[nodiscard]] std::optional<std::string> NoticeOfCoverage(const Camera& camera, const char* what,
                                                          double seen_px);

}  // namespace trammel::part_alignment
