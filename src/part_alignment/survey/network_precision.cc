#include "part_alignment/survey/network_precision.h"

#include <Eigen/Core>
#include <algorithm>
#include <cmath>

#include "geometry/linear_systems.h"

namespace trammel::part_alignment {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

constexpr double kUnchecked = 0.02;  // a redundancy below which a residual tells nothing

// Of a matrix with unit diagonal: what rounding leaves of a direction that nothing determines.
constexpr double kSingular = 1e-11;

// The inverse of a positive matrix whose rows differ in unit, scaled to a unit diagonal meanwhile;
// `determined` becomes false where it has none.
MatrixXd ScaledInverse(const MatrixXd& matrix, bool& determined) {
  const VectorXd root = matrix.diagonal().cwiseSqrt().cwiseInverse();
  const MatrixXd scaled = root.asDiagonal() * matrix * root.asDiagonal();
  const auto inverse =
      scaled.allFinite() ? geometry::SolvePositive(
                               scaled, MatrixXd::Identity(matrix.rows(), matrix.cols()), kSingular)
                         : std::nullopt;
  if (!inverse) {
    determined = false;
    return MatrixXd::Zero(matrix.rows(), matrix.cols());
  }
  return root.asDiagonal() * *inverse * root.asDiagonal();
}

// The inverse within the datum: bordered by the motions it leaves free.
MatrixXd InverseInDatum(MatrixXd matrix, const MatrixXd& motions, Index points, bool& determined) {
  const double scale = matrix.diagonal().head(points).mean();
  matrix += scale * motions * motions.transpose();
  const MatrixXd inverse =
      ScaledInverse(matrix, determined) - motions * motions.transpose() / scale;
  return 0.5 * (inverse + inverse.transpose());
}

// One station beside the reduced unknowns that its observations meet.
struct StationCovariance {
  MatrixXd own;     // 6 × 6
  MatrixXd with;    // 6 × the unknowns
  MatrixXd within;  // of the unknowns
};

StationCovariance CovarianceOf(const ReducedNormal::Eliminated& station, const MatrixXd& inverse,
                               bool& determined) {
  const MatrixXd block_inverse = ScaledInverse(station.block, determined);
  const MatrixXd gain = block_inverse * station.coupling.transpose();
  StationCovariance covariance;
  covariance.within = inverse(station.unknowns, station.unknowns);
  covariance.with = -gain * covariance.within;
  covariance.own = block_inverse - covariance.with * gain.transpose();
  return covariance;
}

// Where a point's and the lens's unknowns stand among the station's; the columns of their partials.
struct UnknownColumns {
  std::vector<Index> of_station;
  std::vector<Index> of_partials;  // x, y, z, then the lens
};

UnknownColumns ColumnsOf(const ReducedNormal::Eliminated& station, const ReducedNormal& normal,
                         Index first_of_point) {
  UnknownColumns columns;
  const auto add = [&](Index unknown, Index partial) {
    const auto at = std::lower_bound(station.unknowns.begin(), station.unknowns.end(), unknown);
    columns.of_station.push_back(at - station.unknowns.begin());
    columns.of_partials.push_back(partial);
  };
  for (Index axis = 0; first_of_point >= 0 && axis < 3; ++axis) add(first_of_point + axis, axis);
  for (Index i = 0; i < kLensParameters; ++i) {
    const Index unknown = normal.index_of_lens[static_cast<std::size_t>(i)];
    if (unknown >= 0) add(unknown, 3 + i);
  }
  return columns;
}

// J Q J^T of one whitened observation.
Eigen::Matrix2d CovarianceOfFitted(const ObservationPartials& partials,
                                   const UnknownColumns& columns,
                                   const StationCovariance& covariance) {
  Eigen::Matrix<double, 2, 3 + kLensParameters> both;
  both << partials.by_point, partials.by_lens;
  const MatrixXd row = both(Eigen::all, columns.of_partials);
  const MatrixXd with = covariance.with(Eigen::all, columns.of_station);
  const Eigen::Matrix2d cross = partials.by_station * with * row.transpose();
  const MatrixXd within = covariance.within(columns.of_station, columns.of_station);
  return partials.by_station * covariance.own * partials.by_station.transpose() + cross +
         cross.transpose() + row * within * row.transpose();
}

NetworkPrecision::StationPrecision StationPrecisionOf(const ReducedNormal::Eliminated& station,
                                                      const ReducedNormal& normal,
                                                      const StationCovariance& covariance) {
  const UnknownColumns lens = ColumnsOf(station, normal, -1);
  std::vector<Index> rows;
  for (const Index partial : lens.of_partials) rows.push_back(6 + partial - 3);
  NetworkPrecision::StationPrecision precision;
  precision.station = station.station;
  precision.covariance.setZero();
  precision.covariance.topLeftCorner<6, 6>() = covariance.own;
  const MatrixXd with = covariance.with(Eigen::all, lens.of_station);
  const MatrixXd within = covariance.within(lens.of_station, lens.of_station);
  for (std::size_t i = 0; i < rows.size(); ++i) {
    const auto at = static_cast<Index>(i);
    precision.covariance.block<6, 1>(0, rows[i]) = with.col(at);
    precision.covariance.block<1, 6>(rows[i], 0) = with.col(at).transpose();
    for (std::size_t k = 0; k < rows.size(); ++k) {
      precision.covariance(rows[i], rows[k]) = within(at, static_cast<Index>(k));
    }
  }
  return precision;
}

void CheckObservations(const Network& network, const ReducedNormal& normal, const MatrixXd& inverse,
                       NetworkPrecision& precision) {
  std::vector<std::vector<std::size_t>> of_station(network.stations.size());
  for (std::size_t i = 0; i < network.observations.size(); ++i) {
    if (TakesPart(network, network.observations[i]))
      of_station[network.observations[i].station].push_back(i);
  }
  for (const auto& station : normal.stations) {
    const StationCovariance covariance = CovarianceOf(station, inverse, precision.determined);
    precision.stations.push_back(StationPrecisionOf(station, normal, covariance));
    for (const std::size_t i : of_station[station.station]) {
      const NetworkObservation& observation = network.observations[i];
      const ObservationPartials partials = PartialsOf(network, observation);
      const UnknownColumns columns =
          ColumnsOf(station, normal, normal.first_of_point[observation.point]);
      const Eigen::Matrix2d left =
          Eigen::Matrix2d::Identity() - CovarianceOfFitted(partials, columns, covariance);
      auto& check = precision.observations[i];
      check.redundancy = 0.5 * left.trace();
      precision.observation_redundancy += left.trace();
      precision.observation_chi_square += partials.residual.squaredNorm();
      const double least =
          check.redundancy - std::hypot(0.5 * (left(0, 0) - left(1, 1)), left(0, 1));
      if (least > kUnchecked) {
        check.test = geometry::SquaredMahalanobisDistance(left, partials.residual);
      }
    }
  }
}

}  // namespace

NetworkPrecision PrecisionOf(const Network& network, const FreeLens& free, bool bars) {
  BundleOptions options;
  options.free = free;
  options.bars = bars;
  const ReducedNormal normal = NormalOf(network, options);
  VectorXd right;
  const Index points = normal.right.size() - std::count(free.begin(), free.end(), true);
  NetworkPrecision precision;
  precision.determined = true;
  const MatrixXd inverse = InverseInDatum(
      Reduce(normal, 0, right), DatumMotions(network, normal, bars), points, precision.determined);
  precision.observations.resize(network.observations.size());
  precision.points = inverse.topLeftCorner(points, points);
  for (std::size_t i = 0; i < kLensParameters; ++i) {
    for (std::size_t j = 0; j < kLensParameters; ++j) {
      const Index a = normal.index_of_lens[i];
      const Index b = normal.index_of_lens[j];
      if (a >= 0 && b >= 0) {
        precision.lens(static_cast<Index>(i), static_cast<Index>(j)) = inverse(a, b);
      }
    }
  }
  CheckObservations(network, normal, inverse, precision);
  return precision;
}

}  // namespace trammel::part_alignment
