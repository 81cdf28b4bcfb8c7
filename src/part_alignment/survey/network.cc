#include "part_alignment/survey/network.h"

#include <Eigen/Cholesky>

namespace trammel::part_alignment {

bool TakesPart(const Network& network, const NetworkObservation& observation) {
  return observation.used && network.stations[observation.station].placed &&
         network.points[observation.point].placed;
}

bool TakesPart(const Network& network, const NetworkBar& bar) {
  return bar.used && network.points[bar.from].placed && network.points[bar.to].placed;
}

std::optional<Eigen::Vector2d> Misclosure(const Network& network,
                                          const NetworkObservation& observation) {
  const auto projection = ProjectLens(
      network.lens,
      network.stations[observation.station].FromObject(network.points[observation.point].at));
  if (!projection) return std::nullopt;
  return projection->pixel - observation.pixel;
}

std::optional<Eigen::Vector3d> Intersect(const std::vector<Eigen::Vector3d>& places,
                                         const std::vector<Eigen::Vector3d>& directions) {
  Eigen::Matrix3d normal = Eigen::Matrix3d::Zero();
  Eigen::Vector3d right = Eigen::Vector3d::Zero();
  for (std::size_t i = 0; i < places.size(); ++i) {
    const Eigen::Matrix3d across =
        Eigen::Matrix3d::Identity() - directions[i] * directions[i].transpose();
    normal += across;
    right += across * places[i];
  }
  constexpr double kParallel = 1e-6;  // about 0.06 degrees between two lines
  const Eigen::LDLT<Eigen::Matrix3d> factor(normal);
  if (places.size() < 2 || factor.vectorD().minCoeff() < kParallel) return std::nullopt;
  return factor.solve(right);
}

void Transform(const Eigen::Matrix3d& rotation, const Eigen::Vector3d& origin, double scale,
               Network& network) {
  for (Station& station : network.stations) {
    station.place = scale * (rotation * (station.place - origin));
    station.rotation = station.rotation * rotation.transpose();
  }
  for (NetworkPoint& point : network.points) point.at = scale * (rotation * (point.at - origin));
}

}  // namespace trammel::part_alignment
