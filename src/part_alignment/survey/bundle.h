// Bundle adjustment: stations, points and lens from all observations and bars together.
#pragma once

#include <Eigen/Core>
#include <array>
#include <vector>

#include "part_alignment/network/descent.h"
#include "part_alignment/network/normal.h"
#include "part_alignment/survey/network.h"

namespace trammel::part_alignment {

/// Lens parameters to solve for; the others are fixed.
using FreeLens = std::array<bool, kLensParameters>;
inline constexpr FreeLens kFocalFree{true};
inline constexpr FreeLens kFocalAndRadialFree{true, false, false, true};
inline constexpr FreeLens kLensFree{true, true, true, true, true, true, true, true};

struct BundleOptions {
  FreeLens free = kLensFree;
  /// Width of Cauchy's loss, in sigmas; 0: least squares.
  double loss_sigma = 0;
  /// True: bars are observations; without them the size is free.
  bool bars = true;
  int max_iterations = 60;
  /// True: points are fixed; only stations and lens are solved for.
  bool fixed_points = false;
};

/// Normal equations. Shared unknowns: the points' coordinates in turn, then the free parameters of
/// the lens. A station's own: its place, then a rotation before the camera.
struct BundleNormal {
  NormalEquations equations;
  std::vector<Eigen::Index> first_of_point;  ///< index of x; -1 of a point that is not solved for
  std::vector<Eigen::Index> index_of_lens;   ///< -1 of a parameter that is not free
};

/// Derivatives and residual of one observation, whitened by its sigma.
struct ObservationPartials {
  Eigen::Vector2d residual;
  Eigen::Matrix<double, 2, 6> by_station;  ///< place, then a turn before the camera
  Eigen::Matrix<double, 2, 3> by_point;
  Eigen::Matrix<double, 2, kLensParameters> by_lens;
};
/// REQUIRES the point before the camera.
[[nodiscard]] ObservationPartials PartialsOf(const Network& network,
                                             const NetworkObservation& observation);

/// Builds the normal equations, weighted by the stated sigmas and, if the options have one, by
/// Cauchy's loss.
[[nodiscard]] BundleNormal NormalOf(const Network& network, const BundleOptions& options);
/// Computes orthonormal columns: the motions of all points that no observation shows (and the
/// change of size, without bars). Rows as the reduced unknowns.
[[nodiscard]] Eigen::MatrixXd DatumMotions(const Network& network, const BundleNormal& normal,
                                           bool bars);

/// Adjusts a free network by Levenberg-Marquardt. Inner constraints fix the points' centroid, mean
/// orientation (and size, without bars) in every step. Does not change stations and points that are
/// not placed. REQUIRES all placed points in front of the stations that see them.
[[nodiscard]] DescentEnd AdjustBundle(const BundleOptions& options, Network& network);

/// Precision by the stated sigmas; nothing is scaled by the residuals.
struct NetworkPrecision {
  /// True if the observations determine all unknowns but the datum. If not, ignore the rest.
  bool determined = false;
  /// Covariance of the placed points' coordinates, in the datum of inner constraints over all of
  /// them: least trace, singular by six (seven without bars).
  Eigen::MatrixXd points;
  /// Covariance of the lens; rows of fixed parameters are 0.
  Eigen::Matrix<double, kLensParameters, kLensParameters> lens =
      Eigen::Matrix<double, kLensParameters, kLensParameters>::Zero();
  /// Check of each of network.observations; 0 if it is not used.
  struct ObservationCheck {
    /// Share of an error that its residual shows, mean of both coordinates, 0 … 1.
    double redundancy = 0;
    /// Test v^T Qvv^-1 v: chi-square of two degrees if the observation is right (Baarda's test of
    /// both coordinates together). 0 if redundancy is too small for a test.
    double test = 0;
  };
  std::vector<ObservationCheck> observations;
  /// Covariance of each used station's position, its turn before the camera and the lens (rows of
  /// fixed parameters are 0), in the same datum.
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
