#include "part_alignment/survey/bundle.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <limits>

#include "base/check.h"
#include "geometry/euler.h"
#include "geometry/linear_systems.h"

namespace trammel::part_alignment {
namespace {

using Eigen::Index;
using Eigen::Matrix3d;
using Eigen::MatrixXd;
using Eigen::Vector3d;
using Eigen::VectorXd;
using Vector6d = Eigen::Matrix<double, 6, 1>;

constexpr double kEnough = 1e-9;  // of the sum of squares in sigmas: a decrease nobody sees
constexpr double kStuckDamping = 1e10;

Matrix3d CrossMatrix(const Vector3d& v) {
  Matrix3d cross;
  cross << 0, -v.z(), v.y(), v.z(), 0, -v.x(), -v.y(), v.x(), 0;
  return cross;
}

// rho(s) of a squared residual s, and its derivative as the weight.
struct Loss {
  double width2 = 0;
  [[nodiscard]] double Cost(double s) const {
    return width2 > 0 ? width2 * std::log1p(s / width2) : s;
  }
  [[nodiscard]] double Weight(double s) const { return width2 > 0 ? 1 / (1 + s / width2) : 1; }
};

Loss LossOf(const BundleOptions& options) { return {options.loss_sigma * options.loss_sigma}; }

double CostOf(const Network& network, const BundleOptions& options) {
  const Loss loss = LossOf(options);
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

struct Step {
  VectorXd reduced;
  std::vector<Vector6d> stations;  ///< as ReducedNormal::stations
};

Step Solve(const ReducedNormal& normal, const MatrixXd& motions, double damping) {
  Step step;
  VectorXd right;
  MatrixXd matrix = Reduce(normal, damping, right);
  const double scale = std::max(matrix.diagonal().mean(), std::numeric_limits<double>::min());
  matrix += scale * motions * motions.transpose();
  const auto solved = geometry::SolvePositive(matrix, right);
  step.reduced = solved ? VectorXd(-*solved) : -geometry::SolveSymmetric(matrix, right);
  for (const auto& station : normal.stations) {
    Eigen::Matrix<double, 6, 6> block = station.block;
    block.diagonal() *= 1 + damping;
    const VectorXd part = step.reduced(station.unknowns);
    step.stations.push_back(
        -geometry::SolveSymmetric(block, station.right + station.coupling.transpose() * part));
  }
  return step;
}

void Apply(const ReducedNormal& normal, const Step& step, Network& network) {
  for (std::size_t i = 0; i < network.points.size(); ++i) {
    if (normal.first_of_point[i] >= 0)
      network.points[i].at += step.reduced.segment<3>(normal.first_of_point[i]);
  }
  for (std::size_t i = 0; i < kLensParameters; ++i) {
    if (normal.index_of_lens[i] >= 0)
      network.lens[static_cast<Index>(i)] += step.reduced[normal.index_of_lens[i]];
  }
  for (std::size_t i = 0; i < normal.stations.size(); ++i) {
    Station& station = network.stations[normal.stations[i].station];
    station.place += step.stations[i].head<3>();
    const Matrix3d turned =
        geometry::RotationFromVector(step.stations[i].tail<3>()) * station.rotation;
    station.rotation = Eigen::Quaterniond(turned).normalized().toRotationMatrix();
  }
}

void AddBars(const Network& network, ReducedNormal& normal) {
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
    normal.matrix.block<3, 3>(from, from) += square;
    normal.matrix.block<3, 3>(to, to) += square;
    normal.matrix.block<3, 3>(from, to) -= square;
    normal.matrix.block<3, 3>(to, from) -= square;
    normal.right.segment<3>(from) -= residual * unit;
    normal.right.segment<3>(to) += residual * unit;
  }
}

Index IndexUnknowns(const Network& network, const FreeLens& free, ReducedNormal& normal) {
  Index unknowns = 0;
  for (const NetworkPoint& point : network.points) {
    normal.first_of_point.push_back(point.placed ? unknowns : -1);
    if (point.placed) unknowns += 3;
  }
  for (const bool is_free : free) normal.index_of_lens.push_back(is_free ? unknowns++ : -1);
  return unknowns;
}

std::vector<Index> UnknownsOf(const NetworkObservation& observation, const ReducedNormal& normal) {
  const Index first = normal.first_of_point[observation.point];
  std::vector<Index> unknowns = {first, first + 1, first + 2};
  for (const Index i : normal.index_of_lens) {
    if (i >= 0) unknowns.push_back(i);
  }
  return unknowns;
}

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

ReducedNormal NormalOf(const Network& network, const BundleOptions& options) {
  ReducedNormal normal;
  const Index size = IndexUnknowns(network, options.free, normal);
  normal.matrix = MatrixXd::Zero(size, size);
  normal.right = VectorXd::Zero(size);
  std::vector<std::vector<const NetworkObservation*>> of_station(network.stations.size());
  for (const NetworkObservation& observation : network.observations) {
    if (TakesPart(network, observation)) of_station[observation.station].push_back(&observation);
  }
  const Loss loss = LossOf(options);
  MatrixXd row(2, 3 + kLensParameters);
  for (std::size_t s = 0; s < of_station.size(); ++s) {
    if (of_station[s].empty()) continue;
    ReducedNormal::Eliminated& out = normal.stations.emplace_back();
    out.station = s;
    out.block.setZero();
    out.right.setZero();
    MatrixXd coupling = MatrixXd::Zero(size, 6);
    for (const NetworkObservation* observation : of_station[s]) {
      const ObservationPartials partials = PartialsOf(network, *observation);
      const double weight = loss.Weight(partials.residual.squaredNorm());
      const auto unknowns = UnknownsOf(*observation, normal);
      const auto columns = static_cast<Index>(unknowns.size());
      row.leftCols<3>() = partials.by_point;
      Index at = 3;
      for (Index i = 0; i < kLensParameters; ++i) {
        if (options.free[static_cast<std::size_t>(i)]) row.col(at++) = partials.by_lens.col(i);
      }
      const auto used = row.leftCols(columns);
      normal.matrix(unknowns, unknowns) += weight * used.transpose() * used;
      normal.right(unknowns) += weight * used.transpose() * partials.residual;
      coupling(unknowns, Eigen::all) += weight * used.transpose() * partials.by_station;
      out.block += weight * partials.by_station.transpose() * partials.by_station;
      out.right += weight * partials.by_station.transpose() * partials.residual;
      out.unknowns.insert(out.unknowns.end(), unknowns.begin(), unknowns.end());
    }
    std::sort(out.unknowns.begin(), out.unknowns.end());
    out.unknowns.erase(std::unique(out.unknowns.begin(), out.unknowns.end()), out.unknowns.end());
    out.coupling = coupling(out.unknowns, Eigen::all);
  }
  if (options.bars) AddBars(network, normal);
  return normal;
}

MatrixXd Reduce(const ReducedNormal& normal, double damping, VectorXd& right) {
  MatrixXd matrix = normal.matrix;
  matrix.diagonal() *= 1 + damping;
  right = normal.right;
  for (const auto& station : normal.stations) {
    Eigen::Matrix<double, 6, 6> block = station.block;
    block.diagonal() *= 1 + damping;
    const MatrixXd solved = geometry::SolveSymmetric(block, station.coupling.transpose());
    matrix(station.unknowns, station.unknowns) -= station.coupling * solved;
    right(station.unknowns) -= solved.transpose() * station.right;
  }
  return matrix;
}

MatrixXd DatumMotions(const Network& network, const ReducedNormal& normal, bool bars) {
  Vector3d centroid = Vector3d::Zero();
  double count = 0;
  for (const NetworkPoint& point : network.points) {
    if (point.placed) {
      centroid += point.at;
      ++count;
    }
  }
  centroid /= count;
  MatrixXd motions = MatrixXd::Zero(normal.right.size(), bars ? 6 : 7);
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

BundleFit AdjustBundle(const BundleOptions& options, Network& network) {
  BundleFit fit;
  fit.cost = CostOf(network, options);
  TRAMMEL_CHECK(std::isfinite(fit.cost), "cost = {}", fit.cost);
  double damping = 1e-4;
  while (fit.iterations < options.most_iterations) {
    ++fit.iterations;
    const ReducedNormal normal = NormalOf(network, options);
    const MatrixXd motions = DatumMotions(network, normal, options.bars);
    bool accepted = false;
    double decrease = 0;
    while (!accepted && damping < kStuckDamping) {
      Network trial = network;
      const Step step = Solve(normal, motions, damping);
      Apply(normal, step, trial);
      const double cost =
          trial.lens[kFocal] > 0 ? CostOf(trial, options) : std::numeric_limits<double>::infinity();
      decrease = fit.cost - cost;
      accepted = decrease >= -kEnough;
      if (accepted) {
        network = std::move(trial);
        fit.cost = cost;
        damping = std::max(0.1 * damping, 1e-12);
      } else {
        damping = std::max(damping, 1e-9) * 10;
      }
    }
    if (!accepted || decrease < kEnough * (1 + fit.cost)) {
      fit.converged = accepted;
      break;
    }
  }
  return fit;
}

}  // namespace trammel::part_alignment
