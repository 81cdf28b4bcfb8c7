#include "part_alignment/board/board_change.h"

#include <Eigen/LU>
#include <array>
#include <cmath>

#include "geometry/decompositions.h"
#include "geometry/linear_systems.h"

namespace trammel::part_alignment {
namespace {

using Eigen::Index;
using Eigen::Matrix3d;
using Eigen::MatrixXd;
using Eigen::Vector3d;
using Eigen::VectorXd;

constexpr Index kBoardMotion = 0;   // place, turn about the marks' middle
constexpr Index kCameraMotion = 6;  // the same in the taper, about the camera's origin
constexpr Index kLensMotion = 12;   // focal length, principal point
constexpr Index kMotions = 15;
constexpr double kLeastLeft = 1e-5;  // of what is known of a motion once others have had theirs

struct KindOf {
  BoardChangeKind kind;
  Index first;
  Index count;
};
constexpr std::array<KindOf, 3> kKinds = {{{BoardChangeKind::kBoard, kBoardMotion, 6},
                                           {BoardChangeKind::kCamera, kCameraMotion, 6},
                                           {BoardChangeKind::kLens, kLensMotion, 3}}};

Matrix3d Cross(const Vector3d& v) {
  Matrix3d cross;
  cross << 0, -v.z(), v.y(), v.z(), 0, -v.x(), -v.y(), v.x(), 0;
  return cross;
}

// Of one stop, its own place eliminated.
struct StopScore {
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

StopScore ScoreOf(const BoardNetwork& network, const BoardState& state,
                  const std::vector<const BoardNetwork::Sight*>& sights, std::size_t index,
                  const BoardNormal::Stop& stop, Index unknowns) {
  const Index shared = SharedUnknowns(network);
  StopScore score;
  score.with_unknowns.setZero(unknowns, kMotions);
  score.square.setZero(kMotions, kMotions);
  score.gradient.setZero(kMotions);
  if (sights.empty()) return score;
  MatrixXd with_place = MatrixXd::Zero(kMotions, 3);
  const StopFrame frame = FrameOf(network, state, index);
  const Vector3d middle = MiddleOf(state);
  const Vector3d origin = state.camera.taper_from_camera.translation_mm;
  SightPartials partials;
  for (const BoardNetwork::Sight* sight : sights) {
    if (!PartialsOf(network, state, frame, *sight, partials)) continue;
    const double weight = 1 / (sight->sigma_px * sight->sigma_px);
    Eigen::Matrix<double, 2, kMotions> by;
    by.middleCols<3>(kBoardMotion) = partials.by_mark;
    by.middleCols<3>(kBoardMotion + 3) =
        -partials.by_mark * Cross(state.marks_mm[sight->mark] - middle);
    by.middleCols<3>(kCameraMotion) = -partials.by_taper;
    by.middleCols<3>(kCameraMotion + 3) = partials.by_taper * Cross(partials.taper_mm - origin);
    by.middleCols<3>(kLensMotion) = partials.by_shared.leftCols<3>();
    const Eigen::Matrix<double, kMotions, 2> weighted = weight * by.transpose();
    score.square += weighted.lazyProduct(by);
    score.gradient += weighted * partials.residual;
    with_place -= weighted.lazyProduct(partials.by_mark);
    score.with_unknowns.topRows(shared) +=
        partials.by_shared.transpose().lazyProduct(weighted.transpose());
    score.with_unknowns.middleRows<3>(shared + 3 * static_cast<Index>(sight->mark)) +=
        partials.by_mark.transpose().lazyProduct(weighted.transpose());
  }
  const Matrix3d inverse = stop.block.inverse();
  const MatrixXd place_inverse = with_place * inverse;
  for (std::size_t k = 0; k < stop.unknowns.size(); ++k) {
    score.with_unknowns.row(stop.unknowns[k]) -=
        stop.coupling.row(static_cast<Index>(k)) * place_inverse.transpose();
  }
  score.square -= place_inverse * with_place.transpose();
  // The place's own gradient is the negative of `right`.
  score.gradient += place_inverse * stop.right;
  return score;
}

}  // namespace

std::vector<BoardChange> FindChanges(const BoardNetwork& network, const BoardState& state,
                                     const BoardPrecision& precision, std::size_t least) {
  std::vector<std::vector<const BoardNetwork::Sight*>> by_stop(network.stops.size());
  for (const BoardNetwork::Sight& sight : network.sights) {
    if (sight.used && network.stops[sight.view].used) by_stop[sight.view].push_back(&sight);
  }
  std::vector<BoardChange> changes(kKinds.size());
  const Index unknowns = precision.covariance.rows();
  MatrixXd with_unknowns = MatrixXd::Zero(unknowns, kMotions);
  MatrixXd square = MatrixXd::Zero(kMotions, kMotions);
  VectorXd gradient = VectorXd::Zero(kMotions);
  std::size_t after = 0;
  std::size_t all = 0;
  for (const auto& sights : by_stop) all += sights.empty() ? 0 : 1;
  for (std::size_t stop = network.stops.size(); stop-- > 1;) {
    if (by_stop[stop].empty()) continue;
    ++after;
    const StopScore score =
        ScoreOf(network, state, by_stop[stop], stop, precision.normal.stops[stop], unknowns);
    with_unknowns += score.with_unknowns;
    square += score.square;
    gradient += score.gradient;
    if (after < least || all - after < least) continue;
    const MatrixXd solved = precision.covariance * with_unknowns;
    const MatrixXd reduced = square - with_unknowns.transpose() * solved;
    for (std::size_t k = 0; k < kKinds.size(); ++k) {
      const KindOf& kind = kKinds[k];
      const MatrixXd block = reduced.block(kind.first, kind.first, kind.count, kind.count);
      const VectorXd whole = square.diagonal().segment(kind.first, kind.count);
      const VectorXd scale = whole.cwiseMax(1e-300).cwiseSqrt().cwiseInverse();
      const MatrixXd scaled = scale.asDiagonal() * block * scale.asDiagonal();
      // Motions that other unknowns take up entirely are none that could be found.
      const geometry::SymmetricEigen eigen = geometry::DecomposeSymmetric(scaled);
      VectorXd by = VectorXd::Zero(kind.count);
      double statistic = 0;
      int freedom = 0;
      const VectorXd right =
          -scale.cwiseProduct(VectorXd(gradient.segment(kind.first, kind.count)));
      for (Index i = 0; i < kind.count; ++i) {
        if (!(eigen.values[i] > kLeastLeft)) continue;
        const double share = eigen.vectors.col(i).dot(right);
        statistic += share * share / eigen.values[i];
        by += eigen.vectors.col(i) * (share / eigen.values[i]);
        ++freedom;
      }
      if (freedom == 0 || !(statistic > changes[k].statistic)) continue;
      by = scale.cwiseProduct(by);
      changes[k] = {kind.kind, stop, statistic, freedom, by, CameraVector::Zero()};
      const VectorXd moved = solved.middleCols(kind.first, kind.count) * by;
      changes[k].influence = moved.head<kCameraParameters>();
    }
  }
  return changes;
}

}  // namespace trammel::part_alignment
