// Observation of a network: a point in the picture of a station.
#pragma once

#include <Eigen/Core>
#include <cstddef>

namespace trammel::part_alignment {

struct NetworkObservation {
  std::size_t station = 0;
  std::size_t point = 0;
  Eigen::Vector2d pixel = Eigen::Vector2d::Zero();  ///< column, row
  double sigma_px = 0;                              ///< per axis, k = 1
  bool used = true;
};

}  // namespace trammel::part_alignment
