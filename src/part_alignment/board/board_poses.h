// Plans the spindle positions of the pictures of a board, for a camera that is not calibrated yet.
#pragma once

#include <Eigen/Core>
#include <string>
#include <vector>

#include "base/result.h"
#include "part_alignment/board/board_calibration.h"
#include "part_alignment/views/machine_box.h"

namespace trammel::part_alignment {

/// Plans a few pictures around the spindle's position: there, higher, and to two sides, never
/// lower. They separate focal length from distance.
/// @param start_mm  the spindle, with the board in view
/// @param field_mm  width of the picture on the board there, > 0
/// @param room      space that the spindle may use
/// Errors (kSafety): a limit that is too narrow for the pictures, with its name.
[[nodiscard]] Result<std::vector<Eigen::Vector3d>> FirstBoardPoses(const Eigen::Vector3d& start_mm,
                                                                   double field_mm,
                                                                   const MachineBox& room);

/// Approximate camera and board from the first pictures, accurate enough to aim with.
struct BoardSketch {
  Camera camera;  ///< in the spindle, without its place there and without distortion
  /// Marks in the machine's frame, as if the camera were at the spindle's stated position.
  std::vector<Eigen::Vector3d> marks_mm;
  std::vector<std::string> ids;                         ///< mark ids
  double disc_radius_px = 0;                            ///< in the first picture; 0: unknown
  Eigen::Vector3d middle_mm = Eigen::Vector3d::Zero();  ///< centre of the marks
};

/// Finds camera and board by the linear start of the calibration (board_start.h). REQUIRES Validate
/// (board_input.h), all views at one angle of the spindle. Errors (kMeasurement): pictures that no
/// camera takes from these places, with likely causes.
[[nodiscard]] Result<BoardSketch> SketchBoard(const BoardMeasurement& first);

struct BoardPoseOptions {
  MachineBox room;           ///< permitted spindle positions
  int pictures = 40;         ///< 4 … 500
  double highest_mm = 0;     ///< Z of the spindle, at most
  double largest_ratio = 2;  ///< longest to shortest distance, > 1.25
};

struct BoardPoses {
  std::vector<Eigen::Vector3d> spindle_mm;
  double nearest_mm = 0;  ///< camera to board centre, along Z
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

/// Moves the sketch's marks in X and Y to fit a picture at another angle of the spindle. After half
/// a turn they move by twice the camera's distance from the spindle's axis.
/// @returns the median distance of the view's marks from the sketch's afterwards, px.
/// REQUIRES a mark of the sketch in the view.
double ShiftSketch(const BoardView& view, double turn_rad, BoardSketch& sketch);

}  // namespace trammel::part_alignment
