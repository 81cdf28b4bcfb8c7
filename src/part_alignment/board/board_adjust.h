// Adjusts a board's pictures by least squares: camera, marks and machine together.
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

/// Shared unknowns that the adjustment does not change.
using HeldUnknowns = std::vector<bool>;

/// Minimises by Levenberg-Marquardt from `state`, which returns the least squares. The cost is
/// infinite where the camera does not see a used observation.
[[nodiscard]] DescentEnd AdjustBoard(const BoardNetwork& network, const HeldUnknowns& held,
                                     int max_iterations, BoardState& state);

/// Minimises from a first guess with which the camera may not see all used observations.
/// Observations join the network as soon as the camera sees them.
[[nodiscard]] DescentEnd AdjustFirst(const HeldUnknowns& held, int max_iterations,
                                     BoardNetwork& network, BoardState& state);

/// Check of one touched or stated coordinate against all other observations.
struct StatedCheck {
  std::optional<std::size_t> touch;  ///< index in the network; absent: the camera's stated place
  Eigen::Index axis = 0;             ///< machine axis; taper axis for the camera's place
  double off_mm = 0;                 ///< adjusted less stated
  double redundancy = 0;             ///< the share of an error that it shows, 0 … 1
  double test = 0;  ///< off_mm in its standard deviations; 0 where nothing checks it
};

/// Precision at the least squares: information on all unknowns, and the residuals compared.
struct BoardPrecision {
  NormalEquations normal;      ///< shared unknowns and marks; per station: its place
  Eigen::MatrixXd covariance;  ///< shared unknowns and marks; rows of fixed ones are 0
  int observations = 0;
  double pixel_square = 0;  ///< sum of squared residuals of the observations, in sigmas
  double pixel_redundancy = 0;
  double place_square = 0;  ///< sum of squared station shifts, in sigmas
  double place_redundancy = 0;
  std::vector<Eigen::Matrix3d> off_covariance;  ///< covariance per station's place
  std::vector<StatedCheck> stated;
};
[[nodiscard]] BoardPrecision PrecisionOf(const BoardNetwork& network, const BoardState& state,
                                         const HeldUnknowns& held);

enum class BoardChangeKind { kBoard, kCamera, kLens };

/// Change from one station on, estimated by a score test on the adjustment without the change.
struct BoardChange {
  BoardChangeKind kind = BoardChangeKind::kBoard;
  std::size_t first_after = 0;  ///< station
  double statistic = 0;         ///< chi-square of `freedom` where nothing changed
  int freedom = 0;
  /// Size of the change. Board in the machine, or camera in the taper: mm, then rad. Lens: focal
  /// length in mm, principal point in px.
  Eigen::VectorXd by;
  /// Effect on the adjusted camera parameters.
  CameraVector influence = CameraVector::Zero();
};

/// Finds the most significant change of each kind. Skips changes at stations before `least` and
/// after the last `least` ones. REQUIRES state at its least squares.
[[nodiscard]] std::vector<BoardChange> FindChanges(const BoardNetwork& network,
                                                   const BoardState& state,
                                                   const BoardPrecision& precision,
                                                   std::size_t least);

}  // namespace trammel::part_alignment
