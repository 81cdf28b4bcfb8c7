#include "part_alignment/survey/bundle.h"

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <limits>

#include "base/check.h"
#include "geometry/euler.h"
#include "geometry/linear_systems.h"

namespace trammel::part_alignment {
using Eigen::Index;
using Eigen::Matrix3d;
using Eigen::MatrixXd;
using Eigen::Vector3d;
using Eigen::VectorXd;

namespace {

CauchyLoss LossOf(const BundleOptions& options) {
  return {options.loss_sigma * options.loss_sigma};
}

double CostOf(const Network& network, const BundleOptions& options) {
  const CauchyLoss loss = LossOf(options);
  double cost = 0;
  for (const NetworkObservation& observation : network.observations) {
    if (!TakesPart(network, observation)) continue;
    const auto misclosure = Misclosure(network, observation);
    if (!misclosure) return std::numeric_limits<double>::infinity();
    cost += loss.Cost(misclosure->squaredNorm() / (observation.sigma_px * observation.sigma_px));
  }
  for (const NetworkBar& bar : network.bars) {
    if (!options.bars || !TakesPart(network, bar)) continue;
    const double length = (network.points[bar.to].at - network.points[bar.from].at).norm();
    const double residual = (length - bar.length) / bar.sigma;
    cost += residual * residual;
  }
  return cost;
}

Network Moved(const BundleNormal& normal, const NormalStep& step, Network network) {
  for (std::size_t i = 0; i < network.points.size(); ++i) {
    if (normal.first_of_point[i] >= 0)
      network.points[i].at += step.shared.segment<3>(normal.first_of_point[i]);
  }
  for (std::size_t i = 0; i < kLensParameters; ++i) {
    if (normal.index_of_lens[i] >= 0)
      network.lens[static_cast<Index>(i)] += step.shared[normal.index_of_lens[i]];
  }
  for (std::size_t i = 0; i < step.stations.size(); ++i) {
    Station& station = network.stations[normal.equations.stations[i].station];
    station.place += step.stations[i].head<3>();
    const Matrix3d turned =
        geometry::RotationFromVector(step.stations[i].tail<3>()) * station.rotation;
    station.rotation = Eigen::Quaterniond(turned).normalized().toRotationMatrix();
  }
  return network;
}

void AddBars(const Network& network, BundleNormal& normal) {
  NormalEquations& sums = normal.equations;
  for (const NetworkBar& bar : network.bars) {
    if (!TakesPart(network, bar)) continue;
    const Vector3d along = network.points[bar.to].at - network.points[bar.from].at;
    const double length = along.norm();
    TRAMMEL_CHECK(length > 0, "bar from {} to {}", bar.from, bar.to);
    const Vector3d unit = along / (length * bar.sigma);
    const double residual = (length - bar.length) / bar.sigma;
    const Index from = normal.first_of_point[bar.from];
    const Index to = normal.first_of_point[bar.to];
    const Matrix3d square = unit * unit.transpose();
    sums.matrix.block<3, 3>(from, from) += square;
    sums.matrix.block<3, 3>(to, to) += square;
    sums.matrix.block<3, 3>(from, to) -= square;
    sums.matrix.block<3, 3>(to, from) -= square;
    sums.right.segment<3>(from) += residual * unit;
    sums.right.segment<3>(to) -= residual * unit;
  }
}

Index IndexUnknowns(const Network& network, const BundleOptions& options, BundleNormal& normal) {
  Index unknowns = 0;
  for (const NetworkPoint& point : network.points) {
    const bool is_free = point.placed && !options.fixed_points;
    normal.first_of_point.push_back(is_free ? unknowns : -1);
    if (is_free) unknowns += 3;
  }
  for (const bool is_free : options.free) normal.index_of_lens.push_back(is_free ? unknowns++ : -1);
  return unknowns;
}

ObservationRow RowOf(const Network& network, const NetworkObservation& observation,
                     const CauchyLoss& loss, const BundleNormal& normal) {
  const ObservationPartials partials = PartialsOf(network, observation);
  const double root = std::sqrt(loss.Weight(partials.residual.squaredNorm()));
  const Index first = normal.first_of_point[observation.point];
  ObservationRow row;
  std::vector<Index> columns;  // columns of both
  for (Index axis = 0; first >= 0 && axis < 3; ++axis) {
    row.unknowns.push_back(first + axis);
    columns.push_back(axis);
  }
  for (Index i = 0; i < kLensParameters; ++i) {
    const Index unknown = normal.index_of_lens[static_cast<std::size_t>(i)];
    if (unknown < 0) continue;
    row.unknowns.push_back(unknown);
    columns.push_back(3 + i);
  }
  Eigen::Matrix<double, 2, 3 + kLensParameters> both;
  both << partials.by_point, partials.by_lens;
  row.by_shared = root * both(Eigen::all, columns);
  row.by_own = root * partials.by_station;
  row.residual = root * partials.residual;
  return row;
}

// Inner constraints: no step changes the datum.
struct BundleModel {
  const BundleOptions& options;
  struct Linearised {
    BundleNormal normal;
    MatrixXd motions;
  };
  [[nodiscard]] double Cost(const Network& network) const {
    return network.lens[kFocal] > 0 ? CostOf(network, options)
                                    : std::numeric_limits<double>::infinity();
  }
  [[nodiscard]] Linearised Linearise(const Network& network) const {
    Linearised at{NormalOf(network, options), {}};
    if (!options.fixed_points) at.motions = DatumMotions(network, at.normal, options.bars);
    return at;
  }
  [[nodiscard]] Proposal<Network> Propose(const Linearised& at, double damping,
                                          const Network& network) const {
    const NormalStep step = Solve(at.normal.equations, at.motions, damping);
    return {Moved(at.normal, step, network), step.decrement};
  }
};

}  // namespace

ObservationPartials PartialsOf(const Network& network, const NetworkObservation& observation) {
  const Station& station = network.stations[observation.station];
  const Vector3d camera = station.FromObject(network.points[observation.point].at);
  const auto projection = ProjectLens(network.lens, camera);
  TRAMMEL_CHECK(projection.has_value(), "point {} is not before station {}", observation.point,
                observation.station);
  const double weight = 1 / observation.sigma_px;
  ObservationPartials partials;
  partials.residual = weight * (projection->pixel - observation.pixel);
  partials.by_point = weight * projection->by_point * station.rotation;
  partials.by_station.leftCols<3>() = -partials.by_point;
  partials.by_station.rightCols<3>() = -weight * projection->by_point * CrossMatrix(camera);
  partials.by_lens = weight * projection->by_lens;
  return partials;
}

BundleNormal NormalOf(const Network& network, const BundleOptions& options) {
  BundleNormal normal;
  const Index size = IndexUnknowns(network, options, normal);
  normal.equations.matrix = MatrixXd::Zero(size, size);
  normal.equations.right = VectorXd::Zero(size);
  std::vector<std::vector<ObservationRow>> rows(network.stations.size());
  const CauchyLoss loss = LossOf(options);
  for (const NetworkObservation& observation : network.observations) {
    if (!TakesPart(network, observation)) continue;
    rows[observation.station].push_back(RowOf(network, observation, loss, normal));
  }
  for (std::size_t s = 0; s < rows.size(); ++s) {
    if (!rows[s].empty()) AddStation(s, rows[s], normal.equations);
  }
  if (options.bars) AddBars(network, normal);
  return normal;
}

MatrixXd DatumMotions(const Network& network, const BundleNormal& normal, bool bars) {
  Vector3d centroid = Vector3d::Zero();
  double count = 0;
  for (const NetworkPoint& point : network.points) {
    if (point.placed) {
      centroid += point.at;
      ++count;
    }
  }
  centroid /= count;
  MatrixXd motions = MatrixXd::Zero(normal.equations.right.size(), bars ? 6 : 7);
  double size2 = 0;
  for (const NetworkPoint& point : network.points) {
    if (point.placed) size2 += (point.at - centroid).squaredNorm();
  }
  const double size = std::sqrt(size2 / count);
  for (std::size_t i = 0; i < network.points.size(); ++i) {
    const Index first = normal.first_of_point[i];
    if (first < 0) continue;
    const Vector3d about = (network.points[i].at - centroid) / size;
    motions.block<3, 3>(first, 0).setIdentity();
    motions.block<3, 3>(first, 3) = -CrossMatrix(about);
    if (!bars) motions.block<3, 1>(first, 6) = about;
  }
  const MatrixXd gram = motions.transpose() * motions;
  return geometry::SolveLower(geometry::CholeskyRoot(gram), motions.transpose()).transpose();
}

DescentEnd AdjustBundle(const BundleOptions& options, Network& network) {
  const DescentEnd end =
      Minimise(BundleModel{options}, {.max_iterations = options.max_iterations}, network);
  TRAMMEL_CHECK(std::isfinite(end.cost), "cost = {}", end.cost);
  return end;
}

namespace {

constexpr double kUnchecked = 0.02;  // a redundancy below which a residual tells nothing

// Computes the inverse within the datum: bordered by the motions that it does not fix.
MatrixXd InverseInDatum(MatrixXd matrix, const MatrixXd& motions, Index points, bool& determined) {
  const double scale = points > 0 ? matrix.diagonal().head(points).mean() : 1;
  matrix += scale * motions * motions.transpose();
  const MatrixXd inverse =
      ScaledInverse(matrix, determined) - motions * motions.transpose() / scale;
  return 0.5 * (inverse + inverse.transpose());
}

// The lens's unknowns are the last of all.
NetworkPrecision::StationPrecision StationPrecisionOf(const NormalEquations::Station& station,
                                                      const BundleNormal& normal,
                                                      const StationCovariance& covariance) {
  std::vector<Index> rows = {0, 1, 2, 3, 4, 5};
  for (Index i = 0; i < kLensParameters; ++i) {
    if (normal.index_of_lens[static_cast<std::size_t>(i)] >= 0) rows.push_back(6 + i);
  }
  const auto lens = std::ssize(rows) - 6;
  const MatrixXd with = covariance.with.rightCols(lens);
  MatrixXd whole(6 + lens, 6 + lens);
  whole << covariance.own, with, with.transpose(), covariance.within.bottomRightCorner(lens, lens);
  NetworkPrecision::StationPrecision precision;
  precision.station = station.station;
  precision.covariance.setZero();
  precision.covariance(rows, rows) = whole;
  return precision;
}

void CheckObservations(const Network& network, const BundleNormal& normal, const MatrixXd& inverse,
                       NetworkPrecision& precision) {
  std::vector<std::vector<std::size_t>> of_station(network.stations.size());
  for (std::size_t i = 0; i < network.observations.size(); ++i) {
    if (TakesPart(network, network.observations[i]))
      of_station[network.observations[i].station].push_back(i);
  }
  for (const auto& station : normal.equations.stations) {
    const StationCovariance covariance = CovarianceOf(station, inverse, precision.determined);
    precision.stations.push_back(StationPrecisionOf(station, normal, covariance));
    for (const std::size_t i : of_station[station.station]) {
      const ObservationRow row = RowOf(network, network.observations[i], {}, normal);
      const Eigen::Matrix2d left =
          Eigen::Matrix2d::Identity() - FittedCovariance(row, station, covariance);
      auto& check = precision.observations[i];
      check.redundancy = 0.5 * left.trace();
      precision.observation_redundancy += left.trace();
      const double least =
          check.redundancy - std::hypot(0.5 * (left(0, 0) - left(1, 1)), left(0, 1));
      if (least > kUnchecked) {
        check.test = geometry::SquaredMahalanobisDistance(left, row.residual);
      }
    }
  }
}

}  // namespace

NetworkPrecision PrecisionOf(const Network& network, const FreeLens& free, bool bars) {
  BundleOptions options;
  options.free = free;
  options.bars = bars;
  const BundleNormal normal = NormalOf(network, options);
  const Index points = normal.equations.right.size() - std::count(free.begin(), free.end(), true);
  NetworkPrecision precision;
  precision.determined = true;
  const MatrixXd inverse =
      InverseInDatum(Reduce(normal.equations, 0).matrix, DatumMotions(network, normal, bars),
                     points, precision.determined);
  precision.observations.resize(network.observations.size());
  precision.points = inverse.topLeftCorner(points, points);
  std::vector<Index> lens;
  for (Index i = 0; i < kLensParameters; ++i) {
    if (free[static_cast<std::size_t>(i)]) lens.push_back(i);
  }
  precision.lens(lens, lens) = inverse.bottomRightCorner(std::ssize(lens), std::ssize(lens));
  CheckObservations(network, normal, inverse, precision);
  return precision;
}

}  // namespace trammel::part_alignment
