// Bundle adjustment: stations, points and lens from all observations and bars together.
#pragma once

#include <Eigen/Core>
#include <array>
#include <vector>

#include "part_alignment/survey/network.h"

namespace trammel::part_alignment {

/// Which of the lens's parameters are solved for; the others stay.
using FreeLens = std::array<bool, kLensParameters>;
inline constexpr FreeLens kFocalFree{true};
inline constexpr FreeLens kFocalAndRadialFree{true, false, false, true};
inline constexpr FreeLens kLensFree{true, true, true, true, true, true, true, true};

struct BundleOptions {
  FreeLens free = kLensFree;
  /// Cauchy's loss with this width, in sigmas; 0: least squares.
  double loss_sigma = 0;
  /// Bars are observations; without them the size is free.
  bool bars = true;
  int most_iterations = 60;
};

struct BundleFit {
  bool converged = false;
  int iterations = 0;
  /// Sum of squared residuals in sigmas (of Cauchy's loss where there is one).
  double cost = 0;
};

/// The normal equations, the stations eliminated. Unknowns: the placed points' coordinates in turn,
/// then the free parameters of the lens.
struct ReducedNormal {
  /// What one station had before it was eliminated.
  struct Eliminated {
    std::size_t station = 0;
    std::vector<Eigen::Index> unknowns;  ///< that its observations meet
    Eigen::MatrixXd coupling;            ///< unknowns × 6: place, then rotation
    Eigen::Matrix<double, 6, 6> block;
    Eigen::Matrix<double, 6, 1> right;
  };
  Eigen::MatrixXd matrix;  ///< before the elimination: points and lens alone
  Eigen::VectorXd right;
  std::vector<Eliminated> stations;
  std::vector<Eigen::Index> first_of_point;  ///< index of x; -1 of a point that is not placed
  std::vector<Eigen::Index> index_of_lens;   ///< -1 of a parameter that is not free
};

/// One observation's part in the adjustment, whitened by its sigma.
struct ObservationPartials {
  Eigen::Vector2d residual;
  Eigen::Matrix<double, 2, 6> by_station;  ///< place, then a turn before the camera
  Eigen::Matrix<double, 2, 3> by_point;
  Eigen::Matrix<double, 2, kLensParameters> by_lens;
};
/// REQUIRES the point before the camera.
[[nodiscard]] ObservationPartials PartialsOf(const Network& network,
                                             const NetworkObservation& observation);

/// Weights: the stated sigmas', less Cauchy's where the options have a loss.
[[nodiscard]] ReducedNormal NormalOf(const Network& network, const BundleOptions& options);

/// The matrix with every station eliminated, its diagonals raised by `damping` of themselves before
/// that.
[[nodiscard]] Eigen::MatrixXd Reduce(const ReducedNormal& normal, double damping,
                                     Eigen::VectorXd& right);

/// Orthonormal columns: the motions of all points that no observation notices (and the change of
/// size, without bars). Rows as the reduced unknowns.
[[nodiscard]] Eigen::MatrixXd DatumMotions(const Network& network, const ReducedNormal& normal,
                                           bool bars);

/// Levenberg-Marquardt on a free network: every step leaves the points' centroid, mean orientation
/// (and size, without bars) as they were, by inner constraints. Stations and points that are not
/// placed stay as they are. REQUIRES all placed points before the stations that see them.
[[nodiscard]] BundleFit AdjustBundle(const BundleOptions& options, Network& network);

}  // namespace trammel::part_alignment
