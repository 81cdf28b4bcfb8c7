// How two cameras stood to one another, from lines of sight to points that both saw.
#pragma once

#include <Eigen/Core>
#include <span>
#include <vector>

#include "base/random.h"

namespace trammel::part_alignment {

/// x_second = rotation · (x_first - place), |place| = 1.
struct RelativeOrientation {
  Eigen::Matrix3d rotation = Eigen::Matrix3d::Identity();
  Eigen::Vector3d place = Eigen::Vector3d::UnitX();  ///< of the second camera, first's frame
  double median_error = 0;                           ///< of all lines' coplanarity, about rad
};

/// Essential matrices that make five pairs of unit lines coplanar: at most ten (Nister 2004, by the
/// action matrix of Stewenius, Engels and Nister 2006). Coplanarity: second^T · E · first = 0.
/// Holds for points in a plane too.
[[nodiscard]] std::vector<Eigen::Matrix3d> FivePointEssentials(
    std::span<const Eigen::Vector3d, 5> first, std::span<const Eigen::Vector3d, 5> second);

/// Least median over draws of five: the best orientations that differ by more than 2 degrees, at
/// most `most`, best first. Points in a plane leave two that are alike good.
/// @param first, second  unit lines of sight to the same points; fewer than six give none.
[[nodiscard]] std::vector<RelativeOrientation> OrientPair(std::span<const Eigen::Vector3d> first,
                                                          std::span<const Eigen::Vector3d> second,
                                                          std::size_t most, Random& random);

}  // namespace trammel::part_alignment
