// Calibrates a camera on the machine: a printed board on the table, pictures from several spindle
// positions.
#pragma once

#include <Eigen/Core>
#include <optional>
#include <string>
#include <vector>

#include "base/measured.h"
#include "base/rejection.h"
#include "base/result.h"
#include "part_alignment/camera/camera.h"
#include "part_alignment/pose/measurement.h"
#include "part_alignment/targets/image_ellipse.h"

namespace trammel::part_alignment {

/// Picture of the board with the spindle position that the machine reports.
struct BoardView {
  std::string picture;
  /// Image size, px; 0: the camera's.
  int width_px = 0;
  int height_px = 0;
  Eigen::Vector3d spindle_mm = Eigen::Vector3d::Zero();
  Eigen::Matrix3d spindle_rotation = Eigen::Matrix3d::Identity();
  std::vector<Observation> observations;  ///< each mark once
  /// Images of the discs whose centres the observations are: one for each observation, or none.
  std::vector<ImageEllipse> discs = {};
};

/// Touch of a mark's centre with a tool on the spindle's axis, its tip `tool_length_mm` below the
/// gauge line. Tools of different lengths check one another.
struct BoardTouch {
  std::string mark;
  Eigen::Vector3d spindle_mm = Eigen::Vector3d::Zero();  ///< machine's reading
  double tool_length_mm = 0;
  /// Uncertainty, k = 1, along the machine's axes; infinite where the touch measures nothing.
  Eigen::Vector3d sigma_mm = Eigen::Vector3d::Zero();
};

/// Standard uncertainties of a machine, k = 1. No picture shows its scale and squareness: these
/// come from its acceptance test and enter the covariance.
struct BoardMachineErrors {
  double scale = 20e-6;           ///< relative, each axis
  double squareness_rad = 20e-6;  ///< each pair of axes
  double lean_rad = 100e-6;       ///< spindle axis against the machine's, per direction
  double index_rad = 2e-3;        ///< of the spindle's angle, anew whenever it turns
  /// Per axis and approach; the pictures' estimate replaces it where there is one.
  double repeatability_mm = 0.004;
};

/// Position of the camera's origin in the taper, from a drawing or another calibration.
struct CameraPlacePrior {
  Eigen::Vector3d at_mm = Eigen::Vector3d::Zero();
  Eigen::Vector3d sigma_mm = Eigen::Vector3d::Zero();  ///< k = 1, above 0
};

/// Mark on the sheet, at its intended position.
struct PrintedMark {
  std::string id;
  Eigen::Vector2d at_mm = Eigen::Vector2d::Zero();  ///< right and up
};

struct BoardMeasurement {
  /// Input: image size, pixel pitch, convention and side; everything else is measured.
  Camera camera;
  /// Focal length engraved on the lens: pictures cannot separate it from the machine's unit along
  /// its spindle. 0: unknown.
  double lens_focal_length_mm = 0;
  std::vector<BoardView> views;  ///< in the order taken
  std::vector<BoardTouch> touches;
  double tool_length_sigma_mm = 0.010;  ///< per tool, common to all its touches, k = 1
  BoardMachineErrors machine;
  std::optional<CameraPlacePrior> place;
  /// Layout that checks the machine's unit of length, if given; its positions enter no answer.
  std::vector<PrintedMark> layout;
  double disc_radius_mm = 0;  ///< as printed; 0: observations are projected centres
};

struct BoardCalibrateOptions {
  /// Upper limit of the residuals' root mean square, in stated sigmas; beyond it the calibration is
  /// refused.
  double max_residual_sigma = 5;
  /// Upper limit of the focal length's relative uncertainty, k = 1; beyond it the focal length is
  /// not determined.
  double max_focal_uncertainty = 1e-3;
  /// Upper limit of the uncertainty of the camera's place, k = 1; beyond it the place is not
  /// determined.
  double max_place_mm = 1000;
  /// Probability that one of the tests rejects sound data.
  double false_alarm = 1e-3;
};

/// Quantity that no number of pictures determines.
struct NullDirection {
  std::string what;        ///< "the camera's place along the spindle's axis", …
  std::string taken_from;  ///< source of the value; empty: none, and no answer
  std::string closed_by;   ///< observation that resolves it
  std::optional<double> sigma = std::nullopt;  ///< k = 1 as taken, in the unit of `unit`
  std::string unit = {};
};

struct FoundMark {
  std::string id;
  Eigen::Vector3d at_mm = Eigen::Vector3d::Zero();  ///< machine frame
  int observations = 0;
  double rms_px = 0;  ///< per axis
};

struct BoardViewResult {
  std::string picture;
  bool used = false;
  std::string reason;  ///< why not used
  int observations = 0;
  double rms_px = 0;                                 ///< per axis
  Eigen::Vector3d off_mm = Eigen::Vector3d::Zero();  ///< spindle's offset from its stated position
};

/// Measured scale of the printed sheet against its layout.
struct PrintResult {
  double scale_right = 1;  ///< printed / meant
  double scale_up = 1;
  double bend_mm = 0;  ///< largest less smallest distance from its plane
  int marks = 0;
};

/// camera, covariance and lean are valid only with verdict good.
struct BoardCalibration {
  Verdict verdict = Verdict::kRefused;
  std::string reason;
  /// taper_from_camera refers to the taper as the spindle holds it at the first picture's angle:
  /// with the lean of its axis, and the angle as stated there.
  Camera camera;
  CameraCovariance covariance =
      CameraCovariance::Zero();  ///< k = 1, order of kCameraParameterNames
  double nearest_mm = 0;         ///< nearest mark along the camera's axis, from its origin
  double farthest_mm = 0;
  /// Lean of the spindle's axis about x and y of its frame at the first picture, rad, and k = 1.
  Eigen::Vector2d lean_rad = Eigen::Vector2d::Zero();
  Eigen::Vector2d lean_sigma_rad = Eigen::Vector2d::Zero();
  double residual_rms_px = 0;     ///< per axis
  double residual_rms_sigma = 0;  ///< per degree of freedom, in the stated sigmas
  double repeatability_mm = 0;    ///< machine's, as used, k = 1
  int degrees_of_freedom = 0;
  AdjustmentCheck check;  ///< marks in pictures
  std::string unchecked;  ///< unchecked inputs, beside the value; empty: none
  std::vector<NullDirection> null_directions;
  std::vector<FoundMark> marks;
  std::vector<BoardViewResult> views;  ///< one for each
  std::optional<PrintResult> print;
  std::vector<std::string> notices;
};

/// Estimates lens and place of the camera together with the machine's errors and all marks, by
/// least squares. The marks are free in space: the print is not trusted. The first guess is linear,
/// so no guess is needed.
///
/// Its verdicts name: pictures that are the mirror image of their places, a wrong unit, a table
/// that does not belong to the pictures (with the largest residuals), pictures of two sizes, a
/// board or a camera that moved, touches that contradict, heights too alike. Errors (kInput):
/// invalid numbers, a mark twice in a picture, no view. Accuracy: part_alignment_study.
[[nodiscard]] Result<BoardCalibration> CalibrateByBoard(const BoardMeasurement& measurement,
                                                        const BoardCalibrateOptions& options);

}  // namespace trammel::part_alignment
