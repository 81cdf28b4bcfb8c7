// The adjustment of a board's pictures: camera, marks, machine, all together by least squares.
#pragma once

#include <Eigen/Core>
#include <limits>
#include <optional>
#include <vector>

#include "part_alignment/board/board_model.h"

namespace trammel::part_alignment {

/// Normal equations of the shared unknowns and the marks, the stops' places eliminated.
struct BoardNormal {
  struct Stop {
    Eigen::Matrix3d block = Eigen::Matrix3d::Zero();  ///< of its place, with its prior
    Eigen::Vector3d right = Eigen::Vector3d::Zero();
    std::vector<Eigen::Index> unknowns;  ///< that its sights meet, the shared ones first
    Eigen::MatrixXd coupling;            ///< unknowns × 3
    int sights = 0;
  };
  Eigen::MatrixXd matrix;
  Eigen::VectorXd right;  ///< the gradient's negative
  std::vector<Stop> stops;
  double cost = std::numeric_limits<double>::infinity();  ///< sum of squares in sigmas
};

/// Shared unknowns that stay as they are.
using HeldUnknowns = std::vector<bool>;

/// Rows of held unknowns, and of marks that nothing sees, are those of the identity. The cost is
/// infinite where the camera does not see a used sight.
[[nodiscard]] BoardNormal NormalOf(const BoardNetwork& network, const BoardState& state,
                                   const HeldUnknowns& held);

[[nodiscard]] double CostOf(const BoardNetwork& network, const BoardState& state);

struct BoardFit {
  bool converged = false;
  int iterations = 0;
  double cost = std::numeric_limits<double>::infinity();
};

/// Levenberg-Marquardt from `state`, which it leaves at the least squares.
[[nodiscard]] BoardFit AdjustBoard(const BoardNetwork& network, const HeldUnknowns& held,
                                   int most_iterations, BoardState& state);

/// The same from a first guess with which the camera may not see all that it saw: such sights join
/// when it does.
[[nodiscard]] BoardFit AdjustFirst(const HeldUnknowns& held, int most_iterations,
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
  BoardNormal normal;
  Eigen::MatrixXd covariance;  ///< of shared unknowns and marks; rows of held ones are 0
  int sights = 0;
  double pixel_square = 0;  ///< sum of squared residuals of the sights, in sigmas
  double pixel_redundancy = 0;
  double place_square = 0;  ///< of the stops' places, in sigmas
  double place_redundancy = 0;
  std::vector<Eigen::Matrix3d> off_covariance;  ///< of each stop's place
  std::vector<StatedCheck> stated;
};
[[nodiscard]] BoardPrecision PrecisionOf(const BoardNetwork& network, const BoardState& state,
                                         const HeldUnknowns& held);

/// The inverse of a symmetric positive definite matrix whose rows may be of any size.
[[nodiscard]] Eigen::MatrixXd InvertScaled(const Eigen::MatrixXd& matrix);

}  // namespace trammel::part_alignment
