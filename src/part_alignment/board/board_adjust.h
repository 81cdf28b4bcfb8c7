// The adjustment of a board's pictures: camera, marks, machine, all together by least squares.
#pragma once

#include <Eigen/Core>
#include <cstddef>
#include <optional>
#include <string>
#include <vector>

#include "part_alignment/board/board_model.h"
#include "part_alignment/network/descent.h"
#include "part_alignment/network/normal.h"

namespace trammel::part_alignment {

/// Shared unknowns that stay as they are.
using HeldUnknowns = std::vector<bool>;

/// Levenberg-Marquardt from `state`, which it leaves at the least squares. The cost is infinite
/// where the camera does not see a used observation.
[[nodiscard]] DescentEnd AdjustBoard(const BoardNetwork& network, const HeldUnknowns& held,
                                     int most_iterations, BoardState& state);

/// The same from a first guess with which the camera may not see all that it saw: such observations
/// join when it does.
[[nodiscard]] DescentEnd AdjustFirst(const HeldUnknowns& held, int most_iterations,
                                     BoardNetwork& network, BoardState& state);

/// What was touched or stated beside the pictures, one coordinate of it, against all others.
struct StatedCheck {
  std::optional<std::size_t> touch;  ///< of the network; absent: the stated place of the camera
  Eigen::Index axis = 0;             ///< of the machine; of the taper where it is the place
  double off_mm = 0;                 ///< adjusted less stated
  double redundancy = 0;             ///< the share of an error that it shows, 0 … 1
  double test = 0;  ///< off_mm in its standard deviations; 0 where nothing checks it
};

/// At the least squares: what is known of all unknowns, and how the residuals compare.
struct BoardPrecision {
  NormalEquations normal;      ///< of shared unknowns and marks; a station's own: its place
  Eigen::MatrixXd covariance;  ///< of shared unknowns and marks; rows of held ones are 0
  int observations = 0;
  double pixel_square = 0;  ///< sum of squared residuals of the observations, in sigmas
  double pixel_redundancy = 0;
  double place_square = 0;  ///< of the stations' places, in sigmas
  double place_redundancy = 0;
  std::vector<Eigen::Matrix3d> off_covariance;  ///< of each station's place
  std::vector<StatedCheck> stated;
};
[[nodiscard]] BoardPrecision PrecisionOf(const BoardNetwork& network, const BoardState& state,
                                         const HeldUnknowns& held);

enum class BoardChangeKind { kBoard, kCamera, kLens };

/// A change from one station on, as a score test of the adjustment without it has it.
struct BoardChange {
  BoardChangeKind kind = BoardChangeKind::kBoard;
  std::size_t first_after = 0;  ///< station
  double statistic = 0;         ///< chi-square of `freedom` where nothing changed
  int freedom = 0;
  /// Of the board in the machine, or of the camera in the taper: mm, then rad. Of the lens: focal
  /// length in mm, principal point in px.
  Eigen::VectorXd by;
  /// What it did to the camera's parameters that the adjustment found.
  CameraVector influence = CameraVector::Zero();
};

/// The most significant change of each kind. Stations before `least` and after the last `least` are
/// not looked at. REQUIRES state at its least squares.
[[nodiscard]] std::vector<BoardChange> FindChanges(const BoardNetwork& network,
                                                   const BoardState& state,
                                                   const BoardPrecision& precision,
                                                   std::size_t least);

}  // namespace trammel::part_alignment
