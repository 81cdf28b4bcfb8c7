// Orients stations: two relative to one another, one by known points.
#pragma once

#include <Eigen/Core>
#include <array>
#include <cstddef>
#include <optional>
#include <span>
#include <vector>

#include "base/random.h"
#include "part_alignment/survey/network.h"

namespace trammel::part_alignment {

/// Relative orientation: x_second = rotation · (x_first - place), |place| = 1.
struct RelativeOrientation {
  Eigen::Matrix3d rotation = Eigen::Matrix3d::Identity();
  Eigen::Vector3d place = Eigen::Vector3d::UnitX();  ///< second camera in the first's frame
};

/// Computes the essential matrices that make five pairs of unit lines coplanar: at most ten (Nister
/// 2004, by the action matrix of Stewenius, Engels and Nister 2006). Coplanarity: second^T · E ·
/// first = 0. Valid for points in a plane too.
[[nodiscard]] std::vector<Eigen::Matrix3d> FivePointEssentials(
    std::span<const Eigen::Vector3d, 5> first, std::span<const Eigen::Vector3d, 5> second);

/// Finds orientations by the smallest median over draws of five: the best that differ by more than
/// 2 degrees, at most `most`, best first. Points in a plane have two equally good ones.
/// @param first, second  unit lines of sight to the same points; fewer than six yield none.
[[nodiscard]] std::vector<RelativeOrientation> OrientPair(std::span<const Eigen::Vector3d> first,
                                                          std::span<const Eigen::Vector3d> second,
                                                          std::size_t most, Random& random);

/// Finds the stations that see three points along three unit lines: at most four (Grunert 1841, as
/// of Haralick et al. 1994).
[[nodiscard]] std::vector<Station> ThreePointStations(std::span<const Eigen::Vector3d, 3> object,
                                                      std::span<const Eigen::Vector3d, 3> lines);

struct Resection {
  Station station;
  std::size_t observations = 0;  ///< of placed points
  std::size_t agreeing = 0;      ///< within the tolerance
};

/// Draws threes among the observations (indices into network.observations, all of one station) of
/// placed points. Selects the station that agrees with most of them, and refines it by those.
/// Absent with fewer than four.
[[nodiscard]] std::optional<Resection> Resect(const Network& network,
                                              std::span<const std::size_t> observations,
                                              double tolerance_px, Random& random);

/// Least squares of one station (Cauchy's loss of `loss_sigma`, 0: none), with fixed points.
struct StationFit {
  Station station;
  double focal_px = 0;
  double focal_sigma_px = 0;  ///< k = 1, with the stated sigmas
  std::size_t observations = 0;
  double cost = 0;  ///< squares of residuals in stated sigmas, under the loss
};
/// @param free_focal  solves for the focal length too, of this picture alone.
[[nodiscard]] std::optional<StationFit> FitStation(const Network& network,
                                                   std::span<const std::size_t> observations,
                                                   const Station& start, double loss_sigma,
                                                   bool free_focal);

}  // namespace trammel::part_alignment
