#include "part_alignment/board/board_adjust.h"

#include <Eigen/LU>
#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <numeric>
#include <utility>

#include "geometry/decompositions.h"
#include "geometry/linear_systems.h"

namespace trammel::part_alignment {
using Eigen::Index;
using Eigen::Matrix3d;
using Eigen::MatrixXd;
using Eigen::Vector3d;
using Eigen::VectorXd;

namespace {

// Groups the used observations by station.
std::vector<std::vector<const NetworkObservation*>> ObservationsByStation(
    const BoardNetwork& network) {
  std::vector<std::vector<const NetworkObservation*>> by_station(network.stations.size());
  for (const NetworkObservation& observation : network.observations) {
    if (TakesPart(network, observation)) by_station[observation.station].push_back(&observation);
  }
  return by_station;
}

Index MarkIndex(Index shared, std::size_t mark) { return shared + 3 * static_cast<Index>(mark); }

std::vector<Index> FirstUnknowns(Index count) {
  std::vector<Index> unknowns(static_cast<std::size_t>(count));
  std::iota(unknowns.begin(), unknowns.end(), Index{0});
  return unknowns;
}

double PlaceWeight(const BoardNetwork& network) {
  return 1 / std::pow(network.machine.repeatability_mm, 2);
}

// The station's place moves the picture opposite to the mark.
ObservationRow RowOf(const BoardNetwork& network, const NetworkObservation& observation,
                     const MarkPartials& partials) {
  const Index shared = SharedUnknowns(network);
  ObservationRow row;
  row.unknowns = FirstUnknowns(shared);
  for (Index axis = 0; axis < 3; ++axis) {
    row.unknowns.push_back(MarkIndex(shared, observation.point) + axis);
  }
  row.by_shared.resize(2, shared + 3);
  row.by_shared << partials.by_shared, partials.by_mark;
  row.by_shared /= observation.sigma_px;
  row.by_own = -partials.by_mark / observation.sigma_px;
  row.residual = partials.residual / observation.sigma_px;
  return row;
}

// One coordinate known beside the pictures: a touch along an axis, the camera's stated position, or
// a prior of the machine.
struct StatedRow {
  enum Kind { kTouch, kPlace, kPrior } kind = kPrior;
  std::size_t touch = 0;
  Index axis = 0;
  std::vector<Index> unknowns;
  VectorXd by;
  double residual = 0;  // adjusted less stated
  double variance = 1;
};

std::vector<StatedRow> StatedRows(const BoardNetwork& network, const BoardState& state) {
  const Index shared = SharedUnknowns(network);
  std::vector<StatedRow> rows;
  for (std::size_t i = 0; i < network.touches.size(); ++i) {
    const BoardNetwork::Touch& touch = network.touches[i];
    const TouchPartials partials = PartialsOf(network, state, touch);
    for (Index axis = 0; axis < 3; ++axis) {
      if (!std::isfinite(touch.sigma_mm[axis])) continue;
      StatedRow& row = rows.emplace_back();
      row.kind = StatedRow::kTouch;
      row.touch = i;
      row.axis = axis;
      row.unknowns = FirstUnknowns(shared);
      row.unknowns.push_back(MarkIndex(shared, touch.mark) + axis);
      row.by.setOnes(shared + 1);
      row.by.head(shared) = partials.by_shared.row(axis).transpose();
      row.residual = partials.residual_mm[axis];
      row.variance = TouchVariance(network, touch, axis);
    }
  }
  const VectorXd values = SharedOf(network, state);
  const auto add = [&](StatedRow::Kind kind, Index unknown, double stated, double sigma) {
    StatedRow& row = rows.emplace_back();
    row.kind = kind;
    row.axis = unknown - kBoardPlace;
    row.unknowns = {unknown};
    row.by.setOnes(1);
    row.residual = values[unknown] - stated;
    row.variance = sigma * sigma;
  };
  for (Index axis = 0; network.place && axis < 3; ++axis) {
    add(StatedRow::kPlace, kBoardPlace + axis, network.place->at_mm[axis],
        network.place->sigma_mm[axis]);
  }
  for (Index i = kBoardScale; i < shared; ++i) {
    if (PriorSigma(network, i) > 0) add(StatedRow::kPrior, i, 0, PriorSigma(network, i));
  }
  return rows;
}

NormalEquations NormalOf(const BoardNetwork& network, const BoardState& state,
                         const HeldUnknowns& held) {
  const Index size = MarkIndex(SharedUnknowns(network), network.marks);
  NormalEquations normal{MatrixXd::Zero(size, size), VectorXd::Zero(size), {}};
  const auto by_station = ObservationsByStation(network);
  MarkPartials partials;
  for (std::size_t s = 0; s < by_station.size(); ++s) {
    const StationFrame frame = FrameOf(network, state, s);
    std::vector<ObservationRow> rows;
    for (const NetworkObservation* observation : by_station[s]) {
      if (!PartialsOf(network, state, frame, *observation, partials)) continue;
      rows.push_back(RowOf(network, *observation, partials));
    }
    if (rows.empty()) continue;
    AddStation(s, rows, normal);
    normal.stations.back().block.diagonal().array() += PlaceWeight(network);
    normal.stations.back().right -= PlaceWeight(network) * state.off_mm[s];
  }
  for (const StatedRow& row : StatedRows(network, state)) {
    normal.matrix(row.unknowns, row.unknowns) += row.by * row.by.transpose() / row.variance;
    normal.right(row.unknowns) -= row.by * (row.residual / row.variance);
  }
  HoldUnknowns(held, normal);
  return normal;
}

// Model whose cost is the sum of squares in sigmas.
struct BoardModel {
  const BoardNetwork& network;
  const HeldUnknowns& held;
  [[nodiscard]] double Cost(const BoardState& state) const {
    if (!(state.camera.focal_length_mm > 0)) return std::numeric_limits<double>::infinity();
    double cost = 0;
    for (const NetworkObservation& observation : network.observations) {
      if (!TakesPart(network, observation)) continue;
      const auto residual = ResidualOf(network, state, observation);
      if (!residual) return std::numeric_limits<double>::infinity();
      cost += residual->squaredNorm() / (observation.sigma_px * observation.sigma_px);
    }
    for (const Vector3d& off : state.off_mm) cost += PlaceWeight(network) * off.squaredNorm();
    for (const StatedRow& row : StatedRows(network, state)) {
      cost += row.residual * row.residual / row.variance;
    }
    return std::isfinite(cost) ? cost : std::numeric_limits<double>::infinity();
  }
  [[nodiscard]] NormalEquations Linearise(const BoardState& state) const {
    return NormalOf(network, state, held);
  }
  [[nodiscard]] Proposal<BoardState> Propose(const NormalEquations& normal, double damping,
                                             const BoardState& state) const {
    const NormalStep step = Solve(normal, {}, damping);
    const Index shared = SharedUnknowns(network);
    BoardState next = state;
    SetShared(SharedOf(network, state) + step.shared.head(shared), next);
    for (std::size_t i = 0; i < next.marks_mm.size(); ++i) {
      next.marks_mm[i] += step.shared.segment<3>(MarkIndex(shared, i));
    }
    for (std::size_t i = 0; i < step.stations.size(); ++i) {
      next.off_mm[normal.stations[i].station] += step.stations[i];
    }
    return {std::move(next), step.decrement};
  }
};

StatedCheck CheckOf(const StatedRow& row, const MatrixXd& covariance) {
  constexpr double kNothing = 1e-6;  // minimum redundancy; below it: unchecked
  const double of_others = row.by.dot(covariance(row.unknowns, row.unknowns) * row.by);
  StatedCheck check;
  if (row.kind == StatedRow::kTouch) check.touch = row.touch;
  check.axis = row.axis;
  check.off_mm = row.residual;
  check.redundancy = 1 - std::min(1.0, of_others / row.variance);
  if (check.redundancy > kNothing) {
    check.test = row.residual / std::sqrt(row.variance * check.redundancy);
  }
  return check;
}

// Computes the covariance; rows of held unknowns are 0.
MatrixXd CovarianceOf(const NormalEquations& normal, const HeldUnknowns& held) {
  const MatrixXd matrix = Reduce(normal, 0).matrix;
  const VectorXd scale = matrix.diagonal().cwiseSqrt().cwiseInverse();
  const MatrixXd scaled = scale.asDiagonal() * matrix * scale.asDiagonal();
  const MatrixXd inverse =
      geometry::SolveSymmetric(scaled, MatrixXd::Identity(matrix.rows(), matrix.cols()));
  const MatrixXd whole = scale.asDiagonal() * inverse * scale.asDiagonal();
  MatrixXd covariance = (whole + whole.transpose()) / 2;
  for (std::size_t i = 0; i < held.size(); ++i) {
    if (!held[i]) continue;
    covariance.row(static_cast<Index>(i)).setZero();
    covariance.col(static_cast<Index>(i)).setZero();
  }
  return covariance;
}

}  // namespace

DescentEnd AdjustBoard(const BoardNetwork& network, const HeldUnknowns& held, int max_iterations,
                       BoardState& state) {
  return Minimise(BoardModel{network, held}, {.max_iterations = max_iterations}, state);
}

DescentEnd AdjustFirst(const HeldUnknowns& held, int max_iterations, BoardNetwork& network,
                       BoardState& state) {
  std::vector<NetworkObservation*> hidden;
  for (NetworkObservation& observation : network.observations) {
    if (!TakesPart(network, observation) || ResidualOf(network, state, observation)) continue;
    observation.used = false;
    hidden.push_back(&observation);
  }
  const DescentEnd end = AdjustBoard(network, held, max_iterations, state);
  if (hidden.empty()) return end;
  for (NetworkObservation* observation : hidden) {
    observation->used = ResidualOf(network, state, *observation).has_value();
  }
  return AdjustBoard(network, held, max_iterations, state);
}

BoardPrecision PrecisionOf(const BoardNetwork& network, const BoardState& state,
                           const HeldUnknowns& held) {
  BoardPrecision precision;
  precision.normal = NormalOf(network, state, held);
  precision.covariance = CovarianceOf(precision.normal, held);
  for (const NetworkObservation& observation : network.observations) {
    if (!TakesPart(network, observation)) continue;
    if (const auto residual = ResidualOf(network, state, observation)) {
      precision.pixel_square +=
          residual->squaredNorm() / (observation.sigma_px * observation.sigma_px);
    }
    ++precision.observations;
  }
  // The redundancies of all observations and priors sum to equations minus unknowns.
  const std::vector<bool> seen = SeenMarks(network);
  double redundancy = 2.0 * precision.observations -
                      3.0 * static_cast<double>(std::count(seen.begin(), seen.end(), true));
  redundancy -= static_cast<double>(std::count(held.begin(), held.end(), false));
  for (const StatedRow& row : StatedRows(network, state)) {
    const StatedCheck check = CheckOf(row, precision.covariance);
    redundancy += 1 - check.redundancy;
    if (row.kind != StatedRow::kPrior) precision.stated.push_back(check);
  }
  precision.off_covariance.assign(network.stations.size(), Matrix3d::Zero());
  bool determined = true;  // each place has its prior
  for (const NormalEquations::Station& station : precision.normal.stations) {
    Matrix3d& off = precision.off_covariance[station.station];
    off = part_alignment::CovarianceOf(station, precision.covariance, determined).own;
    precision.place_square += PlaceWeight(network) * state.off_mm[station.station].squaredNorm();
    precision.place_redundancy += 3 - PlaceWeight(network) * off.trace();
  }
  precision.pixel_redundancy = redundancy - precision.place_redundancy;
  return precision;
}

namespace {

constexpr Index kBoardMotion = 0;   // place, turn about the marks' middle
constexpr Index kCameraMotion = 6;  // the same in the taper, about the camera's origin
constexpr Index kLensMotion = 12;   // focal length, principal point
constexpr Index kMotions = 15;
constexpr double kMinLeft = 1e-5;  // minimum share of a motion's information left by others

struct KindOf {
  BoardChangeKind kind;
  Index first;
  Index count;
};
constexpr std::array<KindOf, 3> kKinds = {{{BoardChangeKind::kBoard, kBoardMotion, 6},
                                           {BoardChangeKind::kCamera, kCameraMotion, 6},
                                           {BoardChangeKind::kLens, kLensMotion, 3}}};

// Score of one station, its own position eliminated.
struct StationScore {
  MatrixXd with_unknowns;  ///< unknowns × kMotions
  MatrixXd square;
  VectorXd gradient;
};

Vector3d MiddleOf(const BoardState& state) {
  Vector3d middle = Vector3d::Zero();
  for (const Vector3d& mark : state.marks_mm) {
    middle += mark / static_cast<double>(state.marks_mm.size());
  }
  return middle;
}

StationScore ScoreOf(const BoardNetwork& network, const BoardState& state,
                     const std::vector<const NetworkObservation*>& observations,
                     const NormalEquations::Station& station, Index unknowns) {
  StationScore score;
  score.with_unknowns.setZero(unknowns, kMotions);
  score.square.setZero(kMotions, kMotions);
  score.gradient.setZero(kMotions);
  MatrixXd with_place = MatrixXd::Zero(kMotions, 3);
  const StationFrame frame = FrameOf(network, state, station.station);
  const Vector3d middle = MiddleOf(state);
  const Vector3d origin = state.camera.taper_from_camera.translation_mm;
  MarkPartials partials;
  for (const NetworkObservation* observation : observations) {
    if (!PartialsOf(network, state, frame, *observation, partials)) continue;
    Eigen::Matrix<double, 2, kMotions> by;
    by.middleCols<3>(kBoardMotion) = partials.by_mark;
    by.middleCols<3>(kBoardMotion + 3) =
        -partials.by_mark * CrossMatrix(state.marks_mm[observation->point] - middle);
    by.middleCols<3>(kCameraMotion) = -partials.by_taper;
    by.middleCols<3>(kCameraMotion + 3) =
        partials.by_taper * CrossMatrix(partials.taper_mm - origin);
    by.middleCols<3>(kLensMotion) = partials.by_shared.leftCols<3>();
    by /= observation->sigma_px;
    const ObservationRow row = RowOf(network, *observation, partials);
    score.square += by.transpose().lazyProduct(by);
    score.gradient += by.transpose() * row.residual;
    with_place += by.transpose().lazyProduct(row.by_own);
    score.with_unknowns(row.unknowns, Eigen::all) += row.by_shared.transpose().lazyProduct(by);
  }
  const Matrix3d inverse = station.block.inverse();
  const MatrixXd place_inverse = with_place * inverse;
  for (std::size_t k = 0; k < station.unknowns.size(); ++k) {
    score.with_unknowns.row(station.unknowns[k]) -=
        station.coupling.row(static_cast<Index>(k)) * place_inverse.transpose();
  }
  score.square -= place_inverse * with_place.transpose();
  // The place's own gradient is the negative of `right`.
  score.gradient += place_inverse * station.right;
  return score;
}

}  // namespace

std::vector<BoardChange> FindChanges(const BoardNetwork& network, const BoardState& state,
                                     const BoardPrecision& precision, std::size_t least) {
  const auto by_station = ObservationsByStation(network);
  std::vector<BoardChange> changes(kKinds.size());
  const Index unknowns = precision.covariance.rows();
  MatrixXd with_unknowns = MatrixXd::Zero(unknowns, kMotions);
  MatrixXd square = MatrixXd::Zero(kMotions, kMotions);
  VectorXd gradient = VectorXd::Zero(kMotions);
  std::size_t after = 0;
  const auto& stations = precision.normal.stations;
  for (auto station = stations.rbegin(); station != stations.rend(); ++station) {
    if (station->station == 0) continue;
    ++after;
    const StationScore score =
        ScoreOf(network, state, by_station[station->station], *station, unknowns);
    with_unknowns += score.with_unknowns;
    square += score.square;
    gradient += score.gradient;
    if (after < least || stations.size() - after < least) continue;
    const MatrixXd solved = precision.covariance * with_unknowns;
    const MatrixXd reduced = square - with_unknowns.transpose() * solved;
    for (std::size_t k = 0; k < kKinds.size(); ++k) {
      const KindOf& kind = kKinds[k];
      const MatrixXd block = reduced.block(kind.first, kind.first, kind.count, kind.count);
      const VectorXd whole = square.diagonal().segment(kind.first, kind.count);
      const VectorXd scale = whole.cwiseMax(1e-300).cwiseSqrt().cwiseInverse();
      const MatrixXd scaled = scale.asDiagonal() * block * scale.asDiagonal();
      // Motions that other unknowns absorb entirely cannot be found.
      const geometry::SymmetricEigen eigen = geometry::DecomposeSymmetric(scaled);
      VectorXd by = VectorXd::Zero(kind.count);
      double statistic = 0;
      int freedom = 0;
      const VectorXd right =
          -scale.cwiseProduct(VectorXd(gradient.segment(kind.first, kind.count)));
      for (Index i = 0; i < kind.count; ++i) {
        if (!(eigen.values[i] > kMinLeft)) continue;
        const double share = eigen.vectors.col(i).dot(right);
        statistic += share * share / eigen.values[i];
        by += eigen.vectors.col(i) * (share / eigen.values[i]);
        ++freedom;
      }
      if (freedom == 0 || !(statistic > changes[k].statistic)) continue;
      by = scale.cwiseProduct(by);
      changes[k] = {kind.kind, station->station, statistic, freedom, by, CameraVector::Zero()};
      const VectorXd moved = solved.middleCols(kind.first, kind.count) * by;
      changes[k].influence = moved.head<kCameraParameters>();
    }
  }
  return changes;
}

}  // namespace trammel::part_alignment
