// What a bundle adjustment determines, and what its observations check of one another.
#pragma once

#include <Eigen/Core>
#include <vector>

#include "part_alignment/survey/bundle.h"

namespace trammel::part_alignment {

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
  double observation_chi_square = 0;
  double observation_redundancy = 0;  ///< sum over all coordinates
};

/// REQUIRES a network at its least squares.
[[nodiscard]] NetworkPrecision PrecisionOf(const Network& network, const FreeLens& free, bool bars);

}  // namespace trammel::part_alignment
