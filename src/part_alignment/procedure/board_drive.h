// Takes the pictures of a printed board that calibrate the camera in a spindle, with no camera
// file.
#pragma once

#include <functional>
#include <set>
#include <string>
#include <vector>

#include "base/result.h"
#include "part_alignment/board/board_calibration.h"
#include "part_alignment/procedure/align_route.h"
#include "part_alignment/procedure/survey_pictures.h"

namespace trammel::procedure {

/// The outside of a drive over a board. `move_to` and `stands_at` are required.
struct BoardHooks : ViewHooks {
  /// Whether the machine may move as told; asked before the first pictures and before the others.
  std::function<Result<bool>(const std::string& how)> may_move;
  /// Turns the spindle about its axis, by the machine or by a person. With `half_turn`.
  std::function<Result<void>(double c_deg)> turn_to;
  /// Keeps the views that were taken so far, with what was seen in them.
  std::function<Result<void>(const part_alignment::BoardMeasurement& so_far)> keep_views;
  std::function<void(const std::string& line)> tell;  ///< plan and progress
};

struct BoardDriveOptions {
  /// Pitch, convention and side of the camera; its size is that of the first picture.
  part_alignment::BoardMeasurement board;  ///< with disc_radius_mm above 0; without views
  std::set<std::string> marks;             ///< that the sheet has
  SurveyReadOptions reading;
  RouteOptions route;
  int pictures = 40;        ///< at the spindle's first angle, 12 … 500
  double highest_mm = 1e5;  ///< Z of the spindle, at most
  bool half_turn = false;   ///< half as many at 180 degrees, a quarter at the first angle again
  double feed_mm_min = 3000;
  double settle_s = 0.5;  ///< for the time that the plan tells
};

/// Takes first pictures about where the spindle stands, plans all others by what they show, asks,
/// drives, and returns to where the spindle stood. Nothing goes below the height it stood at.
/// Pictures that show too little of the board are kept, named and not counted.
/// @returns the board with all views and what was seen in them.
/// Errors: the hooks', with the view at which it happened; the route's and the plan's (kSafety);
/// kMeasurement where too few pictures show the board; kInterrupted where the answer is no. Behind
/// an error that is not the machine's own, or a stop, the spindle is brought back first.
[[nodiscard]] Result<part_alignment::BoardMeasurement> DriveOverBoard(
    const BoardDriveOptions& options, const BoardHooks& shop);

}  // namespace trammel::procedure
