// Faults of a set-up that calibrates a camera by a board.
#pragma once

#include <functional>
#include <string>
#include <vector>

#include "base/random.h"
#include "part_alignment/board/board_calibration.h"
#include "sim/spindle/spindle_board.h"

namespace trammel::test {

/// Sets so many pictures: half at C = 0, a quarter at 180 degrees, a quarter at 0 again.
void SetStops(sim::BoardSetup& setup, int count, double low_mm, double high_mm);

/// A fault put into a sound set-up, and how it must be answered.
struct BoardFault {
  std::string name;
  std::function<void(sim::BoardSetup&, Random&)> in_world = {};
  std::function<void(part_alignment::BoardMeasurement&, Random&)> in_table = {};
  std::string words;         ///< any of them, parted by |
  bool may_be_good = false;  ///< where it is named in a notice, or harmless
};

/// What moves or changes while the pictures are taken.
[[nodiscard]] std::vector<BoardFault> BoardMishaps();
/// A table of places that is not that of the pictures.
[[nodiscard]] std::vector<BoardFault> WrongBoardTables();
/// Pictures that are odd, or that leave something open.
[[nodiscard]] std::vector<BoardFault> OddBoardPictures();

}  // namespace trammel::test
