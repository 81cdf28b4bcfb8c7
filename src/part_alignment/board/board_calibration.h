// A camera's calibration on the machine: a printed board on the table, pictures from places of the
// spindle.
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

/// A picture of the board, taken from a place that the machine states.
struct BoardView {
  std::string picture;
  /// Its size, px; 0: the camera's.
  int width_px = 0;
  int height_px = 0;
  Eigen::Vector3d spindle_mm = Eigen::Vector3d::Zero();
  Eigen::Matrix3d spindle_rotation = Eigen::Matrix3d::Identity();
  std::vector<Observation> observations;  ///< each mark once
  /// Images of the discs whose centres the observations are, one for each, or none.
  std::vector<ImageEllipse> discs = {};
};

/// A mark's centre touched with a tool on the spindle's axis, its tip `tool_length_mm` below the
/// gauge line. Tools of different lengths check one another.
struct BoardTouch {
  std::string mark;
  Eigen::Vector3d spindle_mm = Eigen::Vector3d::Zero();  ///< as the machine states it
  double tool_length_mm = 0;
  /// k = 1, along the machine's axes; infinite where the touch tells nothing.
  Eigen::Vector3d sigma_mm = Eigen::Vector3d::Zero();
};

/// What a machine may be wrong by, k = 1. Its scale and squareness are seen in no picture: what
/// stands here comes from its acceptance test, and goes into the covariance.
struct BoardMachineErrors {
  double scale = 20e-6;           ///< relative, each axis
  double squareness_rad = 20e-6;  ///< each pair of axes
  double lean_rad = 100e-6;       ///< of the spindle's axis against the machine's, each way
  double index_rad = 2e-3;        ///< of the spindle's angle, anew whenever it turns
  /// Of each axis in each approach; where the pictures tell, what they tell takes its place.
  double repeatability_mm = 0.004;
};

/// Where the camera's origin is in the taper, from a drawing or another calibration.
struct CameraPlacePrior {
  Eigen::Vector3d at_mm = Eigen::Vector3d::Zero();
  Eigen::Vector3d sigma_mm = Eigen::Vector3d::Zero();  ///< k = 1, above 0
};

/// A mark on the sheet as it was meant to be printed.
struct PrintedMark {
  std::string id;
  Eigen::Vector2d at_mm = Eigen::Vector2d::Zero();  ///< right and up
};

struct BoardMeasurement {
  /// Its size, pitch, convention and side; everything else is measured.
  Camera camera;
  /// As engraved on the lens: no picture tells the focal length from the machine's unit along its
  /// spindle. 0: not known.
  double lens_focal_length_mm = 0;
  std::vector<BoardView> views;  ///< in the order in which they were taken
  std::vector<BoardTouch> touches;
  double tool_length_sigma_mm = 0.010;  ///< of each tool, in all its touches the same, k = 1
  BoardMachineErrors machine;
  std::optional<CameraPlacePrior> place;
  /// Where given, the machine's unit of length is checked by it; its places go into no answer.
  std::vector<PrintedMark> layout;
  double disc_radius_mm = 0;  ///< as printed; 0: observations are the centres' own images
};

struct BoardCalibrateOptions {
  /// Residuals beyond this many stated sigmas (root mean square) refuse the calibration.
  double most_residual_sigma = 5;
  /// A focal length less certain than this fraction of itself is not determined, k = 1.
  double most_focal_uncertainty = 1e-3;
  /// A camera's place less certain than this (k = 1) is not determined.
  double most_place_mm = 1000;
  /// Probability that sound data are found at fault by one of the tests.
  double false_alarm = 1e-3;
};

/// What the pictures cannot tell, whatever their number.
struct NullDirection {
  std::string what;        ///< "the camera's place along the spindle's axis", …
  std::string taken_from;  ///< what it was taken from; empty: from nothing, and there is no answer
  std::string closed_by;   ///< what would tell it
  std::optional<double> sigma = std::nullopt;  ///< k = 1 as taken, in the unit of `unit`
  std::string unit = {};
};

struct FoundMark {
  std::string id;
  Eigen::Vector3d at_mm = Eigen::Vector3d::Zero();  ///< in the machine
  int observations = 0;
  double rms_px = 0;  ///< per axis
};

struct BoardViewResult {
  std::string picture;
  bool used = false;
  std::string reason;  ///< why not
  int observations = 0;
  double rms_px = 0;                                 ///< per axis
  Eigen::Vector3d off_mm = Eigen::Vector3d::Zero();  ///< of the spindle from where it was stated
};

/// What the sheet became, against its layout.
struct PrintResult {
  double scale_right = 1;  ///< printed / meant
  double scale_up = 1;
  double bend_mm = 0;  ///< largest less smallest distance from its plane
  int marks = 0;
};

/// camera, covariance and lean are meant only with verdict good.
struct BoardCalibration {
  Verdict verdict = Verdict::kRefused;
  std::string reason;
  /// taper_from_camera is that of the taper as the spindle carries it at the first picture's angle:
  /// with the lean of its axis, and the angle as stated there.
  Camera camera;
  CameraCovariance covariance =
      CameraCovariance::Zero();  ///< k = 1, order of kCameraParameterNames
  double nearest_mm = 0;         ///< of the marks, along the camera's axis from its origin
  double farthest_mm = 0;
  /// Of the spindle's axis about x and y of its frame at the first picture, rad, and k = 1.
  Eigen::Vector2d lean_rad = Eigen::Vector2d::Zero();
  Eigen::Vector2d lean_sigma_rad = Eigen::Vector2d::Zero();
  double residual_rms_px = 0;     ///< per axis
  double residual_rms_sigma = 0;  ///< per degree of freedom, in the stated sigmas
  double repeatability_mm = 0;    ///< of the machine, as it counted, k = 1
  int degrees_of_freedom = 0;
  AdjustmentCheck check;  ///< of the marks in pictures
  std::string unchecked;  ///< what nothing checks, beside the value; empty: nothing
  std::vector<NullDirection> null_directions;
  std::vector<FoundMark> marks;
  std::vector<BoardViewResult> views;  ///< one for each
  std::optional<PrintResult> print;
  std::vector<std::string> notices;
};

/// Lens and place of the camera together with all marks free in space (the print is not trusted)
/// and the machine's errors, by least squares. No guess is needed: the first is linear.
///
/// Its verdicts name: pictures that are the mirror image of their places, a wrong unit, a table
/// that does not belong to the pictures (with the largest residuals), pictures of two sizes, a
/// board or a camera that moved, touches that contradict, heights too alike. Errors (kInput):
/// numbers that cannot be, a mark twice in a picture, no view. Accuracy: part_alignment_study.
[[nodiscard]] Result<BoardCalibration> CalibrateByBoard(const BoardMeasurement& measurement,
                                                        const BoardCalibrateOptions& options);

}  // namespace trammel::part_alignment
