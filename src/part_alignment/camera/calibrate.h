// Calibrates a camera out of the machine: one target at known places in front of a fixed camera.
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

/// Target's centre in one picture, with the measuring machine's reading of its tip.
struct GridView {
  Eigen::Vector3d tip_mm = Eigen::Vector3d::Zero();  ///< measuring machine's frame
  double column_px = 0;
  double row_px = 0;
  double sigma_px = 0;  ///< per axis, k = 1
};

/// Measurement by a measuring machine (CMM): it carries the target through a pyramid of places in
/// front of the camera. The camera's taper was probed in the same frame.
struct GridMeasurement {
  /// Input: image size, pixel pitch, convention and side; everything else is measured.
  Camera camera;
  geometry::Pose cmm_from_taper;
  /// Uncertainty of the taper in all pictures: x y z in mm, alpha beta gamma in rad; k = 1.
  Eigen::Matrix<double, 6, 1> taper_sigma = Eigen::Matrix<double, 6, 1>::Zero();
  /// Vector from the tip to the target's centre, in the measuring machine's frame.
  Eigen::Vector3d target_from_tip_mm = Eigen::Vector3d::Zero();
  Eigen::Vector3d target_from_tip_sigma_mm = Eigen::Vector3d::Zero();
  /// Uncertainty of the measuring machine's positions, per axis, independent in each: k = 1.
  double position_sigma_mm = 0;
  std::vector<GridView> views;
};

struct CalibrateOptions {
  /// Upper limit of the residuals' root mean square, in stated sigmas; beyond it the calibration is
  /// refused.
  double max_residual_sigma = 3;
  /// Upper limit of the focal length's relative uncertainty, k = 1; beyond it the focal length is
  /// not determined.
  double max_focal_uncertainty = 1e-3;
};

/// Measured minus projected.
struct GridResidual {
  double column_px = 0;
  double row_px = 0;
  double sigma_px = 0;  ///< including the measuring machine's uncertainty
  bool used = true;     ///< false: taken for wrong and left out
};

/// Error with which the rest of the grid predicts one of its planes.
struct HeldOutPlane {
  double distance_mm = 0;  ///< mean, along the camera's axis
  int views = 0;
  double rms_px = 0;     ///< per axis
  double rms_sigma = 0;  ///< in expected sigmas of both uncertainties: about 1
};

/// camera and its covariances are valid only with verdict good.
struct CameraCalibration {
  Verdict verdict = Verdict::kRefused;
  std::string reason;
  Camera camera;
  /// k = 1, in the order of kCameraParameterNames; with the taper's and the target's uncertainty.
  CameraCovariance covariance = CameraCovariance::Zero();
  /// Covariance without those two: the scatter of another grid in the same set-up.
  CameraCovariance scatter = CameraCovariance::Zero();
  double residual_rms_px = 0;     ///< per axis
  double residual_rms_sigma = 0;  ///< 1 where the stated sigmas hold
  int degrees_of_freedom = 0;
  AdjustmentCheck check;
  double nearest_mm = 0;  ///< nearest grid point along the camera's axis, from its origin
  double farthest_mm = 0;
  std::vector<GridResidual> residuals;  ///< one for each view
  std::vector<HeldOutPlane> cross_validation;
  std::vector<std::string> notices;
};

/// Estimates focal length, principal point, distortion and the camera's place in its taper
/// together. The first guess is linear, so no guess is needed. Where residuals are larger than
/// stated, the covariance grows with their square.
/// Errors (kInput): an invalid camera, sigma or number. Verdicts report what the grid does not
/// determine (one plane, too few views) or contradicts (a mirrored picture, residuals beyond
/// reason).
/// Accuracy: exact to 1e-9 px on noise-free grids (calibrate_test).
[[nodiscard]] Result<CameraCalibration> CalibrateCamera(const GridMeasurement& grid,
                                                        const CalibrateOptions& options);

/// Returns a notice if the observations (`what`: "mark") do not cover the picture's corners;
/// otherwise absent.
/// @param seen_px  the farthest from the principal point
[[nodiscard]] std::optional<std::string> NoticeOfCoverage(const Camera& camera, const char* what,
                                                          double seen_px);

}  // namespace trammel::part_alignment
