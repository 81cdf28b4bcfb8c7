#include "part_alignment/survey/resection.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

#include "geometry/decompositions.h"
#include "geometry/euler.h"
#include "geometry/linear_systems.h"
#include "part_alignment/survey/bundle.h"

namespace trammel::part_alignment {
namespace {

using Eigen::Index;
using Eigen::Matrix3d;
using Eigen::Vector3d;

std::vector<double> QuarticRoots(const std::array<double, 5>& rising) {
  Eigen::Matrix4d companion = Eigen::Matrix4d::Zero();
  companion.bottomLeftCorner<3, 3>().setIdentity();
  for (std::size_t i = 0; i < 4; ++i) {
    companion(static_cast<Index>(i), 3) = -rising[i] / rising[4];
  }
  std::vector<double> roots;
  if (!companion.allFinite()) return roots;
  const Eigen::VectorXcd values = geometry::DecomposeGeneral(companion).values;
  constexpr double kReal = 1e-4;  // double roots part by the root of rounding and noise
  for (const auto& value : values) {
    if (std::abs(value.imag()) < kReal * (1 + std::abs(value.real())))
      roots.push_back(value.real());
  }
  return roots;
}

// A right-handed frame on three points.
Matrix3d FrameOn(const Vector3d& a, const Vector3d& b, const Vector3d& c) {
  Matrix3d frame;
  frame.col(0) = (b - a).normalized();
  frame.col(2) = (b - a).cross(c - a).normalized();
  frame.col(1) = frame.col(2).cross(frame.col(0));
  return frame;
}

std::size_t CountAgreeing(const Network& network, const Station& station,
                          std::span<const std::size_t> observations, double tolerance_px,
                          double& total) {
  std::size_t agreeing = 0;
  total = 0;
  for (const std::size_t i : observations) {
    const NetworkObservation& observation = network.observations[i];
    const auto projection =
        ProjectLens(network.lens, station.FromObject(network.points[observation.point].at));
    const double error = projection ? (projection->pixel - observation.pixel).norm() : INFINITY;
    if (error < tolerance_px) ++agreeing;
    total += std::min(error, tolerance_px);
  }
  return agreeing;
}

std::vector<std::size_t> Placed(const Network& network, std::span<const std::size_t> observations) {
  std::vector<std::size_t> placed;
  std::copy_if(
      observations.begin(), observations.end(), std::back_inserter(placed), [&](std::size_t i) {
        return network.observations[i].used && network.points[network.observations[i].point].placed;
      });
  return placed;
}

// The bundle's model with one station, and the points that it sees.
Network StationAlone(const Network& network, const std::vector<std::size_t>& observations,
                     const Station& start) {
  Network alone;
  alone.lens = network.lens;
  alone.stations = {start};
  alone.stations[0].placed = true;
  for (const std::size_t i : observations) {
    const NetworkObservation& observation = network.observations[i];
    alone.observations.push_back(
        {0, alone.points.size(), observation.pixel, observation.sigma_px, true});
    alone.points.push_back(network.points[observation.point]);
  }
  return alone;
}

double CostOfStation(const Network& alone, double width2) {
  double cost = 0;
  for (const NetworkObservation& observation : alone.observations) {
    const auto misclosure = Misclosure(alone, observation);
    if (!misclosure) return std::numeric_limits<double>::infinity();
    const double s = misclosure->squaredNorm() / (observation.sigma_px * observation.sigma_px);
    cost += width2 > 0 ? width2 * std::log1p(s / width2) : s;
  }
  return cost;
}

struct StationNormal {
  Eigen::MatrixXd matrix;
  Eigen::VectorXd right;
};

StationNormal NormalOfStation(const Network& alone, double width2, Index unknowns) {
  StationNormal normal{Eigen::MatrixXd::Zero(unknowns, unknowns), Eigen::VectorXd::Zero(unknowns)};
  Eigen::MatrixXd row(2, unknowns);
  for (const NetworkObservation& observation : alone.observations) {
    const ObservationPartials partials = PartialsOf(alone, observation);
    row.leftCols<6>() = partials.by_station;
    if (unknowns == 7) row.col(6) = partials.by_lens.col(kFocal);
    const double s = partials.residual.squaredNorm();
    const double weight = width2 > 0 ? 1 / (1 + s / width2) : 1;
    normal.matrix += weight * row.transpose() * row;
    normal.right += weight * row.transpose() * partials.residual;
  }
  return normal;
}

}  // namespace

std::vector<Station> ThreePointStations(std::span<const Vector3d, 3> object,
                                        std::span<const Vector3d, 3> lines) {
  const double a2 = (object[1] - object[2]).squaredNorm();
  const double b2 = (object[0] - object[2]).squaredNorm();
  const double c2 = (object[0] - object[1]).squaredNorm();
  const double cos_a = lines[1].dot(lines[2]);
  const double cos_b = lines[0].dot(lines[2]);
  const double cos_c = lines[0].dot(lines[1]);
  const double d = (a2 - c2) / b2;
  const double s = (a2 + c2) / b2;
  const std::array<double, 5> quartic = {
      (1 + d) * (1 + d) - 4 * a2 / b2 * cos_c * cos_c,
      4 * (-d * (1 + d) * cos_b + 2 * a2 / b2 * cos_c * cos_c * cos_b - (1 - s) * cos_a * cos_c),
      2 * (d * d - 1 + 2 * d * d * cos_b * cos_b + 2 * (b2 - c2) / b2 * cos_a * cos_a -
           4 * s * cos_a * cos_b * cos_c + 2 * (b2 - a2) / b2 * cos_c * cos_c),
      4 * (d * (1 - d) * cos_b - (1 - s) * cos_a * cos_c + 2 * c2 / b2 * cos_a * cos_a * cos_b),
      (d - 1) * (d - 1) - 4 * c2 / b2 * cos_a * cos_a};
  std::vector<Station> stations;
  for (const double v : QuarticRoots(quartic)) {
    const double u = ((d - 1) * v * v - 2 * d * cos_b * v + 1 + d) / (2 * (cos_c - v * cos_a));
    const double near2 = b2 / (1 + v * v - 2 * v * cos_b);
    if (!(v > 0 && u > 0 && near2 > 0) || !std::isfinite(u)) continue;
    const double near = std::sqrt(near2);
    const Vector3d first = near * lines[0];
    const Matrix3d camera = FrameOn(first, u * near * lines[1], v * near * lines[2]);
    Station station;
    station.rotation = camera * FrameOn(object[0], object[1], object[2]).transpose();
    station.place = object[0] - station.rotation.transpose() * first;
    station.placed = true;
    if (station.rotation.allFinite() && station.place.allFinite()) stations.push_back(station);
  }
  return stations;
}

std::optional<StationFit> FitStation(const Network& network,
                                     std::span<const std::size_t> observations,
                                     const Station& start, double loss_sigma, bool free_focal) {
  const std::vector<std::size_t> placed = Placed(network, observations);
  const Index unknowns = free_focal ? 7 : 6;
  if (static_cast<Index>(2 * placed.size()) <= unknowns) return std::nullopt;
  Network alone = StationAlone(network, placed, start);
  const double width2 = loss_sigma * loss_sigma;
  double cost = CostOfStation(alone, width2);
  if (!std::isfinite(cost)) return std::nullopt;
  StationNormal normal;
  double damping = 1e-4;
  constexpr int kMostSteps = 40;
  constexpr double kStuckDamping = 1e8;
  for (int step = 0; step < kMostSteps && damping < kStuckDamping; ++step) {
    normal = NormalOfStation(alone, width2, unknowns);
    Eigen::MatrixXd damped = normal.matrix;
    damped.diagonal() *= 1 + damping;
    const Eigen::VectorXd change = -geometry::SolveSymmetric(damped, normal.right);
    Network trial = alone;
    trial.stations[0].place += change.head<3>();
    trial.stations[0].rotation =
        geometry::RotationFromVector(change.segment<3>(3)) * alone.stations[0].rotation;
    if (free_focal) trial.lens[kFocal] += change[6];
    const double trial_cost = trial.lens[kFocal] > 0 ? CostOfStation(trial, width2) : INFINITY;
    if (!(trial_cost <= cost)) {
      damping *= 10;
      continue;
    }
    const bool done = cost - trial_cost < 1e-6 * (1 + cost);
    alone = std::move(trial);
    cost = trial_cost;
    damping = std::max(0.1 * damping, 1e-12);
    if (done) break;
  }
  StationFit fit;
  fit.station = alone.stations[0];
  fit.focal_px = alone.lens[kFocal];
  fit.observations = placed.size();
  fit.cost = cost;
  if (free_focal) {
    const Eigen::VectorXd focal = Eigen::VectorXd::Unit(unknowns, 6);
    const double variance = geometry::SolveSymmetric(normal.matrix, focal)(6, 0);
    if (!(variance > 0)) return std::nullopt;
    fit.focal_sigma_px = std::sqrt(variance);
  }
  return fit;
}

std::optional<Resection> Resect(const Network& network, std::span<const std::size_t> observations,
                                double tolerance_px, Random& random) {
  const std::vector<std::size_t> placed = Placed(network, observations);
  if (placed.size() < 4) return std::nullopt;
  std::vector<std::optional<Vector3d>> lines;
  for (const std::size_t i : placed) {
    lines.push_back(ObservationLine(network.lens, network.observations[i].pixel));
  }
  constexpr int kDraws = 60;
  Resection best;
  best.observations = placed.size();
  double best_total = INFINITY;
  for (int draw = 0; draw < kDraws; ++draw) {
    std::array<std::size_t, 3> three{};
    for (std::size_t& k : three) k = random.Below(placed.size());
    if (three[0] == three[1] || three[0] == three[2] || three[1] == three[2]) continue;
    std::array<Vector3d, 3> object;
    std::array<Vector3d, 3> seen;
    bool whole = true;
    for (std::size_t k = 0; k < 3; ++k) {
      whole = whole && lines[three[k]].has_value();
      if (!whole) break;
      seen[k] = *lines[three[k]];
      object[k] = network.points[network.observations[placed[three[k]]].point].at;
    }
    if (!whole) continue;
    for (const Station& station : ThreePointStations(object, seen)) {
      double total = 0;
      const std::size_t agreeing = CountAgreeing(network, station, placed, tolerance_px, total);
      if (total < best_total) {
        best_total = total;
        best.agreeing = agreeing;
        best.station = station;
      }
    }
  }
  if (best.agreeing < 4) return std::nullopt;
  std::vector<std::size_t> agreed;
  for (const std::size_t i : placed) {
    double total = 0;
    if (CountAgreeing(network, best.station, std::span(&i, 1), tolerance_px, total) == 1)
      agreed.push_back(i);
  }
  constexpr double kWidth = 0.2;  // of the tolerance
  const double sigma_px = network.observations[placed[0]].sigma_px;
  const auto fit =
      FitStation(network, agreed, best.station, kWidth * tolerance_px / sigma_px, false);
  if (!fit) return std::nullopt;
  best.station = fit->station;
  best.station.placed = true;
  double total = 0;
  best.agreeing = CountAgreeing(network, best.station, placed, tolerance_px, total);
  return best;
}

}  // namespace trammel::part_alignment
