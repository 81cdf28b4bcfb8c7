// What changed between two pictures of a board: the board, the camera in its taper, or its lens.
#pragma once

#include <Eigen/Core>
#include <cstddef>
#include <string>
#include <vector>

#include "part_alignment/board/board_adjust.h"

namespace trammel::part_alignment {

enum class BoardChangeKind { kBoard, kCamera, kLens };

/// A change from one stop on, as a score test of the adjustment without it has it.
struct BoardChange {
  BoardChangeKind kind = BoardChangeKind::kBoard;
  std::size_t first_after = 0;  ///< stop
  double statistic = 0;         ///< chi-square of `freedom` where nothing changed
  int freedom = 0;
  /// Of the board in the machine, or of the camera in the taper: mm, then rad. Of the lens: focal
  /// length in mm, principal point in px.
  Eigen::VectorXd by;
  /// What it did to the camera's parameters that the adjustment found.
  CameraVector influence = CameraVector::Zero();
};

/// The most significant change of each kind. Stops before `least` and after the last `least` are
/// not looked at. REQUIRES state at its least squares.
[[nodiscard]] std::vector<BoardChange> FindChanges(const BoardNetwork& network,
                                                   const BoardState& state,
                                                   const BoardPrecision& precision,
                                                   std::size_t least);

}  // namespace trammel::part_alignment
