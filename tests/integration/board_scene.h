// A virtual board on the table, in the words of part alignment.
#pragma once

#include <cstdint>

#include "part_alignment/board/board_calibration.h"
#include "sim/spindle/spindle_board.h"

namespace trammel::test {

/// Table 1's camera, upright, over 11 x 8 marks of a sheet that is printed up to 0.2 % wrong and
/// bent by 0.3 mm; the machine's errors as a good one has them.
/// @param per_turn  pictures at C = 0; half as many at 180 degrees, a quarter at 0 again.
[[nodiscard]] sim::BoardSetup BoardScene(int per_turn = 56);

/// Returns a user's data of it: commanded places, detected marks, no truth.
[[nodiscard]] part_alignment::BoardMeasurement BoardMeasurementOf(const sim::BoardWorld& world);

/// Returns, in the order of kCameraParameterNames, the camera's numbers and its place in the taper
/// as the spindle carries it at the first station.
[[nodiscard]] part_alignment::CameraVector BoardTruth(const sim::BoardWorld& world);

/// Estimated less true; angles the short way round.
[[nodiscard]] part_alignment::CameraVector BoardError(const sim::BoardWorld& world,
                                                      const part_alignment::Camera& camera);

}  // namespace trammel::test
