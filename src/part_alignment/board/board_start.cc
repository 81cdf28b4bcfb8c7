#include "part_alignment/board/board_start.h"

#include <Eigen/Geometry>
#include <Eigen/LU>
#include <algorithm>
#include <cmath>
#include <limits>
#include <map>
#include <optional>

#include "base/statistics.h"
#include "geometry/decompositions.h"
#include "geometry/euler.h"
#include "geometry/linear_systems.h"
#include "part_alignment/board/board_input.h"
#include "part_alignment/camera/calibrate_start.h"
#include "part_alignment/network/normal.h"

namespace trammel::part_alignment {
namespace {

using Eigen::Matrix3d;
using Eigen::MatrixXd;
using Eigen::Vector2d;
using Eigen::Vector3d;
using Matrix39d = Eigen::Matrix<double, 3, 9>;
using Matrix9d = Eigen::Matrix<double, 9, 9>;

constexpr double kSameTurn_rad = 1e-6;
constexpr std::size_t kMinPictures = 4;  // per angle

// Returns the stations at the most frequent angle.
std::vector<std::size_t> LargestGroup(const BoardNetwork& network) {
  std::map<long long, std::vector<std::size_t>> groups;
  for (std::size_t i = 0; i < network.stations.size(); ++i) {
    if (!network.stations[i].used) continue;
    const double turn = std::remainder(network.stations[i].turn_rad, 2 * M_PI);
    groups[std::llround(turn / kSameTurn_rad)].push_back(i);
  }
  std::vector<std::size_t> largest;
  for (const auto& [turn, stations] : groups) {
    if (stations.size() > largest.size()) largest = stations;
  }
  return largest;
}

struct PlanarView {
  std::size_t observation = 0;
  std::size_t station = 0;
  std::size_t point = 0;
  Vector2d at = Vector2d::Zero();  ///< about the picture's middle, half its width is 1
  Vector3d place = Vector3d::Zero();
};

struct PinHole {
  Matrix3d h = Matrix3d::Zero();
  std::map<std::size_t, Vector3d> marks;  ///< H · mark
  double misfit = std::numeric_limits<double>::infinity();
};

// Returns the distance from the pin-hole's projection to the observation; 0 for marks that it
// lacks.
double MissOf(const PinHole& pin_hole, double bend, const PlanarView& observation) {
  const auto mark = pin_hole.marks.find(observation.point);
  if (mark == pin_hole.marks.end()) return 0;
  const Vector3d at = mark->second - pin_hole.h * observation.place;
  const double stretch = 1 + bend * observation.at.squaredNorm();
  return (Vector2d(at.x(), at.y()) / at.z() - observation.at * stretch).norm() / std::abs(stretch);
}

// Solves for H and H · mark so that (H mark - H place) is along each ideal picture point: bend
// straightens it.
PinHole SolvePinHole(const std::vector<PlanarView>& observations, double bend) {
  struct OfMark {
    Matrix3d own = Matrix3d::Zero();
    Matrix39d with_h = Matrix39d::Zero();
    int count = 0;
  };
  std::map<std::size_t, OfMark> marks;
  Matrix9d normal = Matrix9d::Zero();
  for (const PlanarView& observation : observations) {
    const Vector2d q = observation.at * (1 + bend * observation.at.squaredNorm());
    Eigen::Matrix<double, 2, 3> rows;
    rows << 1, 0, -q.x(), 0, 1, -q.y();
    Matrix39d by_h = Matrix39d::Zero();
    for (int r = 0; r < 3; ++r) by_h.block<1, 3>(r, 3 * r) = -observation.place.transpose();
    const Matrix3d square = rows.transpose() * rows;
    OfMark& mark = marks[observation.point];
    mark.own += square;
    const Matrix39d with_h = square * by_h;
    mark.with_h += with_h;
    ++mark.count;
    normal += by_h.transpose().lazyProduct(with_h);
  }
  double count = 0;
  for (const auto& [id, mark] : marks) {
    if (mark.count < 3) continue;
    count += mark.count;
    normal -= mark.with_h.transpose() * geometry::SolveSymmetric(mark.own, mark.with_h);
  }
  PinHole pin_hole;
  const geometry::SymmetricEigen eigen = geometry::DecomposeSymmetric(normal);
  const Eigen::Matrix<double, 9, 1> h = eigen.vectors.col(0);
  pin_hole.h << h.segment<3>(0).transpose(), h.segment<3>(3).transpose(),
      h.segment<3>(6).transpose();
  const double along = pin_hole.h.row(2).norm();
  if (!(along > 0) || count == 0) return pin_hole;
  for (const auto& [id, mark] : marks) {
    if (mark.count < 3) continue;
    pin_hole.marks[id] = -geometry::SolveSymmetric(mark.own, mark.with_h * h);
  }
  double squares = 0;
  for (const PlanarView& observation : observations)
    squares += std::pow(MissOf(pin_hole, bend, observation), 2);
  if (std::isfinite(squares)) pin_hole.misfit = squares;
  return pin_hole;
}

// Finds the bend with the smallest misfit: first coarsely, then between neighbours.
PinHole BestPinHole(const std::vector<PlanarView>& observations, double& bend) {
  PinHole best;
  double step = 0.1;
  double middle = 0.05;
  for (int round = 0; round < 3; ++round) {
    const double centre = middle;
    for (int k = -5; k <= 5; ++k) {
      const double trial = centre + k * step;
      PinHole pin_hole = SolvePinHole(observations, trial);
      if (!(pin_hole.misfit < best.misfit)) continue;
      best = std::move(pin_hole);
      middle = trial;
    }
    step /= 5;
  }
  bend = middle;
  return best;
}

// Removes observations that are off by far more than the others of their picture.
std::vector<std::size_t> TakeStrays(const PinHole& pin_hole, double bend,
                                    std::vector<PlanarView>& observations) {
  std::map<std::size_t, std::vector<double>> by_view;
  std::vector<double> off;
  for (const PlanarView& observation : observations) {
    const double size = MissOf(pin_hole, bend, observation);
    off.push_back(size);
    by_view[observation.station].push_back(size);
  }
  std::map<std::size_t, double> usual;
  for (const auto& [view, sizes] : by_view) usual[view] = Median(sizes);
  constexpr double kFar = 8;     // times the median of the picture
  constexpr double kMin = 0.03;  // in halves of the picture's width
  std::vector<std::size_t> strays;
  std::vector<PlanarView> kept;
  for (std::size_t i = 0; i < observations.size(); ++i) {
    if (off[i] > std::max(kMin, kFar * usual[observations[i].station])) {
      strays.push_back(observations[i].observation);
    } else {
      kept.push_back(observations[i]);
    }
  }
  observations = std::move(kept);
  return strays;
}

struct Spread {
  Vector3d middle = Vector3d::Zero();
  Vector3d axes = Vector3d::Zero();  ///< root mean squares, from the smallest up
  double depth = 0;                  ///< extents along the spindle's axis and across
  double width = 0;
};

Spread SpreadOf(const BoardNetwork& network, const std::vector<std::size_t>& stations) {
  Spread spread;
  const auto count = static_cast<double>(stations.size());
  for (const std::size_t station : stations)
    spread.middle += network.stations[station].stated_mm / count;
  Matrix3d squares = Matrix3d::Zero();
  Vector3d low = Vector3d::Constant(std::numeric_limits<double>::infinity());
  Vector3d high = -low;
  for (const std::size_t station : stations) {
    const Vector3d from = network.stations[station].stated_mm - spread.middle;
    squares += from * from.transpose() / count;
    const Vector3d in_spindle = network.machine_from_spindle.transpose() * from;
    low = low.cwiseMin(in_spindle);
    high = high.cwiseMax(in_spindle);
  }
  spread.axes = geometry::SymmetricEigenvalues(squares).cwiseMax(0).cwiseSqrt();
  spread.depth = high.z() - low.z();
  spread.width = (high - low).head<2>().norm();
  return spread;
}

std::vector<PlanarView> ViewsOf(const BoardNetwork& network,
                                const std::vector<std::size_t>& stations, const Spread& spread) {
  std::vector<bool> wanted(network.stations.size(), false);
  for (const std::size_t station : stations) wanted[station] = true;
  const double half = network.frame.width_px / 2.0;
  const Vector2d middle((network.frame.width_px - 1) / 2.0, (network.frame.height_px - 1) / 2.0);
  const double scale = spread.axes[2] > 0 ? spread.axes[2] : 1;
  std::vector<PlanarView> views;
  for (std::size_t i = 0; i < network.observations.size(); ++i) {
    const NetworkObservation& observation = network.observations[i];
    if (!observation.used || !wanted[observation.station]) continue;
    views.push_back({i, observation.station, observation.point, (observation.pixel - middle) / half,
                     (network.stations[observation.station].stated_mm - spread.middle) / scale});
  }
  return views;
}

// Computes camera and marks of a pin-hole; the rows of a mirrored one cannot be turned upright.
BoardStartFault ReadPinHole(const BoardNetwork& network, std::size_t station, const Spread& spread,
                            PinHole pin_hole, double bend, BoardStart& start) {
  const double half = network.frame.width_px / 2.0;
  const double scale = spread.axes[2] > 0 ? spread.axes[2] : 1;
  const double length = pin_hole.h.row(2).norm();
  if (!(length > 0) || !pin_hole.h.allFinite()) return BoardStartFault::kNoCamera;
  double before = 0;  // marks less those behind
  const double side = network.frame.looks_along == LooksAlong::kPlusZ ? 1 : -1;
  for (const auto& [id, mark] : pin_hole.marks) before += side * mark.z() > 0 ? 1 : -1;
  const double sign = before < 0 ? -1 : 1;
  const Matrix3d h = pin_hole.h * (sign / length);
  const PinholeParts parts = PartsOf(h);
  if (parts.mirrored) return BoardStartFault::kMirrored;
  const double ratio = parts.across / parts.down;
  constexpr double kAlike = 1.5;  // a bent lens and few pictures bend the linear answer as well
  if (!(ratio < kAlike && ratio > 1 / kAlike)) return BoardStartFault::kNoCamera;
  Camera& camera = start.state.camera;
  camera = network.frame;
  camera.focal_length_mm = camera.pixel_pitch_mm * half * (parts.across + parts.down) / 2;
  camera.principal_point_offset_px = parts.principal * half;
  const bool photogrammetry = camera.convention == CameraConvention::kBrownMeasuredToIdeal;
  camera.k1 = (photogrammetry ? bend : -bend) / (half * half);
  camera.k2 = camera.p1 = camera.p2 = 0;
  const Matrix3d machine_from_taper = MachineFromTaper(network, start.state, station);
  const Matrix3d taper_from_camera =
      machine_from_taper.transpose() * parts.camera_from_object.transpose();
  camera.taper_from_camera = {Vector3d::Zero(), geometry::AnglesFromRotation(taper_from_camera)};
  if (side * taper_from_camera(2, 2) > -0.5) return BoardStartFault::kLooksAway;
  const Matrix3d back = pin_hole.h.inverse();
  for (const auto& [id, mark] : pin_hole.marks) {
    start.state.marks_mm[id] = spread.middle + scale * (back * mark);
    start.placed[id] = true;
  }
  return BoardStartFault::kNone;
}

// Computes the camera's place across the axis, from observations at other angles.
void PlaceByTurns(const BoardNetwork& network, std::size_t reference, BoardStart& start) {
  BoardState& state = start.state;
  const Matrix3d first = MachineFromTaper(network, state, reference);
  const Matrix3d turn = geometry::RotationFromAngles(state.camera.taper_from_camera.angles_rad);
  Matrix3d normal = Matrix3d::Zero();
  Vector3d right = Vector3d::Zero();
  for (const NetworkObservation& observation : network.observations) {
    if (!TakesPart(network, observation) || !start.placed[observation.point]) continue;
    const Matrix3d here = MachineFromTaper(network, state, observation.station);
    const Matrix3d by_place = here.transpose() * first - Matrix3d::Identity();
    if (by_place.norm() < 1e-3) continue;
    const auto line = LineOfSight(state.camera, observation.pixel);
    if (!line) continue;
    // The mark is first · place farther away than assumed.
    const Vector3d along = turn * *line;
    const Vector3d offset = here.transpose() * (state.marks_mm[observation.point] -
                                                network.stations[observation.station].stated_mm);
    const Matrix3d cross = CrossMatrix(along);
    const Matrix3d rows = cross * by_place;
    normal += rows.transpose() * rows;
    right -= rows.transpose() * (cross * offset);
  }
  if (!(normal.trace() > 0)) return;
  Matrix3d across = normal;
  across.row(2).setZero();
  across.col(2).setZero();
  right.z() = 0;
  const Vector3d place = geometry::SolveLeastSquares(across, right);
  state.camera.taper_from_camera.translation_mm = place;
  for (std::size_t i = 0; i < state.marks_mm.size(); ++i) {
    if (start.placed[i]) state.marks_mm[i] += first * place;
  }
}

// Places marks that only other angles show.
void PlaceOtherMarks(const BoardNetwork& network, BoardStart& start) {
  BoardState& state = start.state;
  const geometry::Pose& pose = state.camera.taper_from_camera;
  const Matrix3d turn = geometry::RotationFromAngles(pose.angles_rad);
  std::vector<Matrix3d> normal(network.marks, Matrix3d::Zero());
  std::vector<Vector3d> right(network.marks, Vector3d::Zero());
  std::vector<int> count(network.marks, 0);
  for (const NetworkObservation& observation : network.observations) {
    if (!TakesPart(network, observation) || start.placed[observation.point]) continue;
    const auto line = LineOfSight(state.camera, observation.pixel);
    if (!line) continue;
    const Matrix3d here = MachineFromTaper(network, state, observation.station);
    const Vector3d along = here * turn * *line;
    const Vector3d origin =
        network.stations[observation.station].stated_mm + here * pose.translation_mm;
    const Matrix3d off = Matrix3d::Identity() - along * along.transpose();
    normal[observation.point] += off;
    right[observation.point] += off * origin;
    ++count[observation.point];
  }
  for (std::size_t i = 0; i < network.marks; ++i) {
    if (count[i] < 2) continue;
    state.marks_mm[i] = geometry::SolveLeastSquares(normal[i], right[i]);
    start.placed[i] = state.marks_mm[i].allFinite();
  }
}

}  // namespace

BoardStart StartBoard(const BoardNetwork& network) {
  BoardStart start;
  start.state.camera = network.frame;
  start.state.index_rad.assign(network.stays, 0);
  start.state.marks_mm.assign(network.marks, Vector3d::Zero());
  start.state.off_mm.assign(network.stations.size(), Vector3d::Zero());
  start.placed.assign(network.marks, false);
  const std::vector<std::size_t> group = LargestGroup(network);
  if (group.size() < kMinPictures) {
    start.fault = BoardStartFault::kFewPictures;
    return start;
  }
  const Spread spread = SpreadOf(network, group);
  start.depth_mm = spread.depth;
  start.width_mm = spread.width;
  constexpr double kFlat = 1e-3;
  if (!(spread.axes[1] > kFlat * spread.axes[2])) {
    start.fault = BoardStartFault::kOneLine;
    return start;
  }
  if (!(spread.axes[0] > kFlat * spread.axes[2])) {
    start.fault = BoardStartFault::kOneHeight;
    return start;
  }
  double bend = 0;
  std::vector<PlanarView> views = ViewsOf(network, group, spread);
  PinHole pin_hole = BestPinHole(views, bend);
  constexpr int kRounds = 3;
  for (int round = 0; round < kRounds; ++round) {
    const auto strays = TakeStrays(pin_hole, bend, views);
    if (strays.empty()) break;
    start.strays.insert(start.strays.end(), strays.begin(), strays.end());
    pin_hole = BestPinHole(views, bend);
  }
  start.fault = ReadPinHole(network, group.front(), spread, pin_hole, bend, start);
  if (start.fault != BoardStartFault::kNone) {
    // Noise alone may cause this where positions are nearly in one plane.
    constexpr double kShallow = 0.1;
    if (spread.axes[0] < kShallow * spread.axes[2]) start.fault = BoardStartFault::kShallow;
    return start;
  }
  PlaceByTurns(network, group.front(), start);
  PlaceOtherMarks(network, start);
  return start;
}

void UseStart(const BoardStart& start, BoardNetwork& network) {
  for (const std::size_t stray : start.strays) network.observations[stray].used = false;
  for (NetworkObservation& observation : network.observations) {
    observation.used = observation.used && start.placed[observation.point];
  }
  LeaveOutLonely(network);
}

}  // namespace trammel::part_alignment
