// A photogrammetric network: stations of one camera, points, observations between them and scale
// bars.
#pragma once

#include <Eigen/Core>
#include <cstddef>
#include <optional>
#include <vector>

#include "part_alignment/survey/lens.h"

namespace trammel::part_alignment {

/// x_camera = rotation · (x_object - place).
struct Station {
  Eigen::Matrix3d rotation = Eigen::Matrix3d::Identity();
  Eigen::Vector3d place = Eigen::Vector3d::Zero();  ///< projection centre, object frame
  bool placed = false;                              ///< takes part in the adjustment

  [[nodiscard]] Eigen::Vector3d FromObject(const Eigen::Vector3d& object) const {
    return rotation * (object - place);
  }
};

struct NetworkPoint {
  Eigen::Vector3d at = Eigen::Vector3d::Zero();  ///< object frame
  bool placed = false;
};

struct NetworkObservation {
  std::size_t station = 0;
  std::size_t point = 0;
  Eigen::Vector2d pixel = Eigen::Vector2d::Zero();  ///< column, row
  double sigma_px = 0;                              ///< per axis, k = 1
  bool used = true;
};

struct NetworkBar {
  std::size_t from = 0;
  std::size_t to = 0;
  double length = 0;
  double sigma = 0;  ///< k = 1
  bool used = true;
};

/// In any unit of length until bars are used.
struct Network {
  Lens lens = Lens::Zero();
  std::vector<Station> stations;
  std::vector<NetworkPoint> points;
  std::vector<NetworkObservation> observations;
  std::vector<NetworkBar> bars;
};

/// Whether an observation is used and both of its ends are placed.
[[nodiscard]] bool TakesPart(const Network& network, const NetworkObservation& observation);
/// The same of a bar.
[[nodiscard]] bool TakesPart(const Network& network, const NetworkBar& bar);

/// Projected less seen, px; absent where the point is not before the camera.
[[nodiscard]] std::optional<Eigen::Vector2d> Misclosure(const Network& network,
                                                        const NetworkObservation& observation);

/// Where lines (places and unit directions) come closest together; absent for parallel ones.
[[nodiscard]] std::optional<Eigen::Vector3d> Intersect(
    const std::vector<Eigen::Vector3d>& places, const std::vector<Eigen::Vector3d>& directions);

/// Turns, moves and scales everything alike: x -> scale · rotation · (x - origin).
void Transform(const Eigen::Matrix3d& rotation, const Eigen::Vector3d& origin, double scale,
               Network& network);

}  // namespace trammel::part_alignment
