// Runs trammel align calibrate --board, between options and exit code.
#pragma once

#include <string>

#include "base/result.h"
#include "part_alignment/commands/align_outputs.h"

namespace trammel::app {

struct BoardArguments {
  std::string board;         ///< BOARD.json
  std::string observations;  ///< read instead of its pictures
  std::string keep_observations;
  double extra_sigma_px = 0.01;
  AnswerOptions answer;
};

/// @returns the exit code.
[[nodiscard]] Result<int> RunBoardCalibration(const BoardArguments& arguments);

}  // namespace trammel::app
