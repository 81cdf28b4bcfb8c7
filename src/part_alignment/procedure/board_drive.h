// Takes the pictures of a printed board that calibrate the camera in a spindle, without a camera
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

/// Hooks of a drive over a board. `move_to` and `stands_at` are required.
struct BoardHooks : ViewHooks {
  /// Requests permission for the described motion, before the first pictures and before the others.
  std::function<Result<bool>(const std::string& how)> may_move;
  /// Turns the spindle about its axis, by the machine or by hand. With `half_turn`.
  std::function<Result<void>(double c_deg)> turn_to;
  /// Stores the views taken so far, with their observations.
  std::function<Result<void>(const part_alignment::BoardMeasurement& so_far)> keep_views;
  std::function<void(const std::string& line)> tell;  ///< plan and progress
};

struct BoardDriveOptions {
  /// Pitch, convention and side of the camera; its size is that of the first picture.
  part_alignment::BoardMeasurement board;  ///< disc_radius_mm above 0, no views
  std::set<std::string> marks;             ///< marks on the sheet
  SurveyReadOptions reading;
  RouteOptions route;
  int pictures = 40;        ///< at the first spindle angle, 12 … 500
  double highest_mm = 1e5;  ///< Z of the spindle, at most
  bool half_turn = false;   ///< half as many at 180 degrees, a quarter at the first angle again
  double feed_mm_min = 3000;
  double settle_s = 0.5;  ///< for the plan's duration
};

/// Takes first pictures around the spindle's position, plans all others by them, asks, drives, and
/// returns to the start. Never moves below the height of the start. Pictures that show too little
/// of the board are stored, named and not counted.
/// @returns the board with all views and their observations.
/// Errors: the hooks', with the view at which it happened; the route's and the plan's (kSafety);
/// kMeasurement if too few pictures show the board; kInterrupted if the answer is no. After an
/// error that is not the machine's own, or a stop, the spindle returns first.
[[nodiscard]] Result<part_alignment::BoardMeasurement> DriveOverBoard(
    const BoardDriveOptions& options, const BoardHooks& shop);

}  // namespace trammel::procedure
