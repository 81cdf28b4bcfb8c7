// Plans where the spindle takes the pictures of a board whose camera nobody knows yet.
#pragma once

#include <Eigen/Core>
#include <string>
#include <vector>

#include "base/result.h"
#include "part_alignment/board/board_calibration.h"
#include "part_alignment/views/machine_box.h"

namespace trammel::part_alignment {

/// Plans a few pictures around where the spindle stands: there, higher, and to two sides, never
/// lower. They tell focal length and distance apart.
/// @param start_mm  the spindle, with the board in view
/// @param field_mm  width of the picture on the board there, > 0
/// @param room      where the spindle may be
/// Errors (kSafety): a limit that leaves less than the pictures need, with its name.
[[nodiscard]] Result<std::vector<Eigen::Vector3d>> FirstBoardPoses(const Eigen::Vector3d& start_mm,
                                                                   double field_mm,
                                                                   const MachineBox& room);

/// A camera and a board as the first pictures show them: good enough to aim with.
struct BoardSketch {
  Camera camera;  ///< in the spindle, without its place there and without distortion
  /// The marks in the machine, as if the camera were where the spindle is stated.
  std::vector<Eigen::Vector3d> marks_mm;
  std::vector<std::string> ids;                         ///< of the marks
  double disc_radius_px = 0;                            ///< at the first picture; 0: not known
  Eigen::Vector3d middle_mm = Eigen::Vector3d::Zero();  ///< of the marks
};

/// Finds camera and board by the linear start of the calibration (board_start.h).
/// REQUIRES Validate (board_input.h), all views at one angle of the spindle.
/// Errors (kMeasurement): pictures that no camera takes from these places, with what may be wrong.
[[nodiscard]] Result<BoardSketch> SketchBoard(const BoardMeasurement& first);

struct BoardPoseOptions {
  MachineBox room;           ///< where the spindle may be
  int pictures = 40;         ///< 4 … 500
  double highest_mm = 0;     ///< Z of the spindle, at most
  double largest_ratio = 2;  ///< of the longest to the shortest distance, > 1.25
};

struct BoardPoses {
  std::vector<Eigen::Vector3d> spindle_mm;
  double nearest_mm = 0;  ///< from the camera to the board's middle, along Z
  double farthest_mm = 0;
  std::vector<std::string> notices;  ///< limits that were in the way
};

/// Spreads the board over the whole picture, at five heights from that of `start_mm` up. The first
/// pose is the highest, with the board in the picture's middle.
/// @param turn_rad  of the spindle since the sketch
/// Errors (kSafety): limits that leave heights too alike or too few pictures, with their names.
[[nodiscard]] Result<BoardPoses> PlanBoardPoses(const BoardSketch& sketch, double turn_rad,
                                                const Eigen::Vector3d& start_mm,
                                                const BoardPoseOptions& options);

/// Moves the sketch's marks in X and Y to where a picture at another angle of the spindle has them:
/// after half a turn by twice the camera's distance from the spindle's axis.
/// @returns the median distance of the view's marks from where the sketch then has them, px.
/// REQUIRES a mark of the sketch in the view.
double ShiftSketch(const BoardView& view, double turn_rad, BoardSketch& sketch);

}  // namespace trammel::part_alignment
