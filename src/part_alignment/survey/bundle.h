// Bundle adjustment: stations, points and lens from all observations and bars together.
#pragma once

#include <Eigen/Core>
#include <array>
#include <vector>

#include "part_alignment/network/descent.h"
#include "part_alignment/network/normal.h"
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
  /// Points stay where they are: stations and lens alone are solved for.
  bool fixed_points = false;
};

/// Shared unknowns: the points' coordinates in turn, then the free parameters of the lens. A
/// station's own: its place, then a turn before the camera.
struct BundleNormal {
  NormalEquations equations;
  std::vector<Eigen::Index> first_of_point;  ///< index of x; -1 of a point that is not solved for
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
[[nodiscard]] BundleNormal NormalOf(const Network& network, const BundleOptions& options);
/// Orthonormal columns: the motions of all points that no observation notices (and the change of
/// size, without bars). Rows as the reduced unknowns.
[[nodiscard]] Eigen::MatrixXd DatumMotions(const Network& network, const BundleNormal& normal,
                                           bool bars);

/// Levenberg-Marquardt on a free network: every step leaves the points' centroid, mean orientation
/// (and size, without bars) as they were, by inner constraints. Stations and points that are not
/// placed stay as they are. REQUIRES all placed points before the stations that see them.
[[nodiscard]] DescentEnd AdjustBundle(const BundleOptions& options, Network& network);

/// The stated sigmas are taken as they are; nothing is scaled by the residuals.
struct NetworkPrecision {
  /// Whether the observations determine all unknowns but the datum. Nothing else is meant if not.
  bool determined = false;
  /// Of the placed points' coordinates, in the datum of inner constraints over all of them: least
  /// trace, singular by six (seven without bars).
  Eigen::MatrixXd points;
  /// Of the lens; rows of parameters that were not free are 0.
  Eigen::Matrix<double, kLensParameters, kLensParameters> lens =
      Eigen::Matrix<double, kLensParameters, kLensParameters>::Zero();
  /// One for each of network.observations; 0 where it takes no part.
  struct ObservationCheck {
    /// Mean of both coordinates: the share of an error that its residual shows, 0 … 1.
    double redundancy = 0;
    /// v^T Qvv^-1 v: chi-square of two degrees where the observation is right (Baarda's test of
    /// both coordinates together). 0 where redundancy is too small to tell.
    double test = 0;
  };
  std::vector<ObservationCheck> observations;
  /// Of each station that takes part: covariance of its place, its turn before the camera and the
  /// lens (rows of parameters that were not free are 0), in the same datum.
  struct StationPrecision {
    std::size_t station = 0;
    Eigen::Matrix<double, 6 + kLensParameters, 6 + kLensParameters> covariance;
  };
  std::vector<StationPrecision> stations;
  double observation_redundancy = 0;  ///< sum over all coordinates
};

/// REQUIRES a network at its least squares.
[[nodiscard]] NetworkPrecision PrecisionOf(const Network& network, const FreeLens& free, bool bars);

}  // namespace trammel::part_alignment
