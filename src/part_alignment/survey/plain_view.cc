#include "part_alignment/survey/plain_view.h"

#include <Eigen/Geometry>
#include <Eigen/LU>
#include <algorithm>
#include <cmath>
#include <limits>

#include "geometry/linear_systems.h"
#include "part_alignment/survey/network.h"
#include "part_alignment/survey/survey_discs.h"

namespace trammel::part_alignment {
using Eigen::Matrix2d;
using Eigen::Matrix3d;
using Eigen::Vector2d;
using Eigen::Vector3d;

namespace {

Eigen::Matrix<double, 2, 3> SlopeByPoint(const Vector2d& slope, double depth) {
  Eigen::Matrix<double, 2, 3> by_point;
  by_point << 1 / depth, 0, -slope.x() / depth, 0, 1 / depth, -slope.y() / depth;
  return by_point;
}

// Computes the derivative by a turn before the camera, x -> x + turn x x.
Eigen::Matrix<double, 2, 3> SlopeByTurn(const Vector2d& slope) {
  const double x = slope.x();
  const double y = slope.y();
  Eigen::Matrix<double, 2, 3> by_turn;
  by_turn << -x * y, 1 + x * x, -y, -(1 + y * y), x * y, x;
  return by_turn;
}

}  // namespace

PlainView::PlainView(const SurveyPicture& picture, const Station& station, const Lens& lens,
                     const NetworkPrecision::StationPrecision* precision, double range,
                     double noise)
    : station_(station), focal_px_(lens[kFocal]) {
  const double right = picture.width_px - 0.5;
  const double bottom = picture.height_px - 0.5;
  low_ = {-1, -1};
  Vector2d high(1, 1);
  const auto slope_of = [&](const Vector2d& pixel) -> std::optional<Vector2d> {
    const auto line = ObservationLine(lens, pixel);
    if (!line) return std::nullopt;
    return Vector2d(line->head<2>() / line->z());
  };
  const auto set = [&](const Vector2d& pixel, double& bound, int axis) {
    if (const auto slope = slope_of(pixel)) bound = (*slope)[axis];
  };
  set({-0.5, 0.5 * bottom}, low_.x(), 0);
  set({0.5 * right, -0.5}, low_.y(), 1);
  set({right, 0.5 * bottom}, high.x(), 0);
  set({0.5 * right, bottom}, high.y(), 1);
  size_ = (high - low_).cwiseMax(1e-6);
  for (std::size_t k = 0; k < picture.plain.size(); ++k) {
    const PlainPoint& point = picture.plain[k];
    const auto slope = slope_of({point.column_px, point.row_px});
    if (!slope) continue;
    const auto projection = ProjectLens(lens, Vector3d(slope->x(), slope->y(), 1));
    if (!projection) continue;
    const Matrix2d by_slope = projection->by_point.leftCols<2>();
    const Matrix2d slope_by_pixel = by_slope.inverse();
    PlainObservation sight;
    sight.slope = *slope;
    sight.point = k;
    const double sigma_px = noise * point.sigma_px;
    sight.covariance = sigma_px * sigma_px * slope_by_pixel * slope_by_pixel.transpose();
    if (point.disc)
      sight.moments = slope_by_pixel * MomentsOf(*point.disc) * slope_by_pixel.transpose();
    if (precision != nullptr) {
      Eigen::Matrix<double, 2, 6 + kLensParameters> by;
      by.leftCols<3>() = -SlopeByPoint(*slope, range) * station.rotation;
      by.middleCols<3>(3) = SlopeByTurn(*slope);
      by.rightCols<kLensParameters>() = slope_by_pixel * projection->by_lens;
      sight.covariance += geometry::PropagateCovariance(by, precision->covariance);
    }
    sights_.push_back(sight);
  }
  for (const PlainObservation& sight : sights_) {
    usual_ += sight.covariance / static_cast<double>(sights_.size());
  }
  FillCells();
}

std::optional<SlopePrediction> PlainView::Predict(const Vector3d& at) const {
  const Vector3d camera = station_.FromObject(at);
  if (!(camera.z() > 0)) return std::nullopt;
  SlopePrediction prediction;
  prediction.slope = camera.head<2>() / camera.z();
  prediction.by_place = SlopeByPoint(prediction.slope, camera.z()) * station_.rotation;
  return prediction;
}

bool PlainView::InPicture(const Vector2d& slope) const {
  const Vector2d share = (slope - low_).cwiseQuotient(size_);
  return share.minCoeff() >= 0 && share.maxCoeff() <= 1;
}

Vector3d PlainView::Line(const Vector2d& slope) const {
  return station_.rotation.transpose() * Vector3d(slope.x(), slope.y(), 1).normalized();
}

void PlainView::Along(const Vector2d& from, const Vector2d& to, double half,
                      std::vector<std::size_t>& found) const {
  found.clear();
  const Vector2d way = to - from;
  const double length = way.norm();
  const Vector2d unit = length > 0 ? Vector2d(way / length) : Vector2d::UnitX();
  const int axis = std::abs(unit.x()) > std::abs(unit.y()) ? 0 : 1;
  const double cell = size_[axis] / kCells;
  // Cell by cell along the steeper axis, so that no point is found twice.
  const double low = std::min(from[axis], to[axis]) - half;
  const double high = std::max(from[axis], to[axis]) + half;
  const auto [first, last] = CellsOf(low, high, axis);
  for (int i = first; i <= last; ++i) {
    const double begin = low_[axis] + i * cell;
    const double clipped_begin = std::clamp(i == first ? low : begin, low, high);
    const double clipped_end = std::clamp(i == last ? high : begin + cell, low, high);
    const auto at = [&](double value) {
      const double share = length > 0 ? (value - from[axis]) / way[axis] : 0;
      return from[1 - axis] + std::clamp(share, 0.0, 1.0) * way[1 - axis];
    };
    const double a = at(clipped_begin);
    const double b = at(clipped_end);
    constexpr double kAskew = 1.5;  // a band's width across an axis is up to sqrt 2 of its own
    const auto [across_first, across_last] =
        CellsOf(std::min(a, b) - kAskew * half, std::max(a, b) + kAskew * half, 1 - axis);
    for (int j = across_first; j <= across_last; ++j) {
      const int x = axis == 0 ? i : j;
      const int y = axis == 0 ? j : i;
      for (std::size_t k = CellBegin(x, y); k < CellBegin(x, y) + CellSize(x, y); ++k) {
        const Vector2d off = sights_[in_cells_[k]].slope - from;
        const double along = off.dot(unit);
        const double across = std::abs(off.x() * unit.y() - off.y() * unit.x());
        if (across <= half && along >= -half && along <= length + half)
          found.push_back(in_cells_[k]);
      }
    }
  }
}

std::pair<int, int> PlainView::CellsOf(double low, double high, int axis) const {
  const auto cell = [&](double value) {
    const double share = (value - low_[axis]) / size_[axis] * kCells;
    return static_cast<int>(std::clamp(share, 0.0, kCells - 1.0));
  };
  return {cell(low), cell(high)};
}

void PlainView::FillCells() {
  const auto cell_of = [&](const PlainObservation& sight) {
    const int x = CellsOf(sight.slope.x(), sight.slope.x(), 0).first;
    const int y = CellsOf(sight.slope.y(), sight.slope.y(), 1).first;
    return static_cast<std::size_t>(y * kCells + x);
  };
  begins_.assign(kCells * kCells + 1, 0);
  for (const PlainObservation& sight : sights_) ++begins_[cell_of(sight) + 1];
  for (std::size_t i = 1; i < begins_.size(); ++i) begins_[i] += begins_[i - 1];
  std::vector<std::size_t> next(begins_.begin(), begins_.end() - 1);
  in_cells_.resize(sights_.size());
  for (std::size_t k = 0; k < sights_.size(); ++k) in_cells_[next[cell_of(sights_[k])]++] = k;
}

namespace {

constexpr double kOffPlane = 0.0436;  // sine of 2.5 degrees: far more than a gate, seen off a row
constexpr std::size_t kPlaneRays = 14;
constexpr int kEnough = 5;  // rays off any plane: no row of targets explains them

}  // namespace

std::optional<std::pair<double, double>> StretchWithin(const PlainRoom& room, const Vector3d& from,
                                                       const Vector3d& direction) {
  double near = 0;
  double far = std::numeric_limits<double>::infinity();
  for (int axis = 0; axis < 3; ++axis) {
    double a = (room.low[axis] - from[axis]) / direction[axis];
    double b = (room.high[axis] - from[axis]) / direction[axis];
    if (a > b) std::swap(a, b);
    if (std::isnan(a) || std::isnan(b)) continue;
    near = std::max(near, a);
    far = std::min(far, b);
  }
  if (!(near < far) || !std::isfinite(far)) return std::nullopt;
  return std::pair(near, far);
}

bool InRoom(const PlainRoom& room, const Vector3d& at) {
  return (at.array() >= room.low.array()).all() && (at.array() <= room.high.array()).all();
}

bool HasMember(const PlainMatch& match, const PlainMember& member) {
  return std::find(match.members.begin(), match.members.end(), member) != match.members.end();
}

int SeenTogether(const PlainMatch& a, const PlainMatch& b) {
  int together = 0;
  for (std::size_t i = 0, j = 0; i < a.members.size() && j < b.members.size();) {
    const std::size_t of_a = a.members[i].view;
    const std::size_t of_b = b.members[j].view;
    if (of_a == of_b) ++together;
    if (of_a <= of_b) ++i;
    if (of_b <= of_a) ++j;
  }
  return together;
}

std::vector<std::size_t> ObservationsAt(const PlainView& view, const PlainMatch& match,
                                        double gate) {
  std::vector<std::size_t> found;
  const auto prediction = view.Predict(match.at);
  if (!prediction || !view.InPicture(prediction->slope)) return found;
  const Matrix2d of_place =
      prediction->by_place * match.covariance * prediction->by_place.transpose();
  constexpr double kWorse = 4;  // a sight's variance than the usual one's
  const Vector2d half =
      (gate * (of_place + kWorse * view.usual_covariance()).diagonal()).cwiseSqrt();
  view.Near(prediction->slope, half, [&](std::size_t k) {
    const PlainObservation& sight = view.sights()[k];
    const Vector2d off = sight.slope - prediction->slope;
    const Matrix2d covariance = of_place + sight.covariance;
    if (off.dot(covariance.inverse() * off) <= gate) found.push_back(k);
  });
  return found;
}

bool IntersectRays(const std::vector<PlainView>& views, PlainMatch& match) {
  std::vector<Vector3d> places;
  std::vector<Vector3d> lines;
  for (const PlainMember& member : match.members) {
    const PlainView& view = views[member.view];
    places.push_back(view.station().place);
    lines.push_back(view.Line(view.sights()[member.sight].slope));
  }
  const auto start = Intersect(places, lines);
  if (!start) return false;
  match.at = *start;
  constexpr int kSteps = 3;
  for (int step = 0; step <= kSteps; ++step) {
    Matrix3d normal = Matrix3d::Zero();
    Vector3d right = Vector3d::Zero();
    match.chi_square = 0;
    for (const PlainMember& member : match.members) {
      const PlainObservation& sight = views[member.view].sights()[member.sight];
      const auto prediction = views[member.view].Predict(match.at);
      if (!prediction) return false;
      const Matrix2d weight = sight.covariance.inverse();
      const Vector2d off = sight.slope - prediction->slope;
      normal += prediction->by_place.transpose() * weight * prediction->by_place;
      right += prediction->by_place.transpose() * weight * off;
      match.chi_square += off.dot(weight * off);
    }
    const Eigen::LDLT<Matrix3d> factor(normal);
    if (factor.info() != Eigen::Success || !(factor.vectorD().minCoeff() > 0)) return false;
    match.covariance = factor.solve(Matrix3d::Identity());
    if (step < kSteps) match.at += factor.solve(right);
  }
  return match.at.allFinite() && match.covariance.allFinite();
}

// Counts the rays outside the plane through the place that has most of the others. Also counts the
// rays in it, beyond two, whose pictures have nothing else along the plane's line.
void CountOffPlane(const std::vector<PlainView>& views, const PlainRoom& room, PlainMatch& match) {
  match.off_plane = 0;
  match.lonely = 0;
  Vector3d plane = Vector3d::Zero();
  std::vector<Vector3d> rays;
  for (const PlainMember& member : match.members) {
    rays.push_back((views[member.view].station().place - match.at).normalized());
  }
  const std::size_t step = std::max<std::size_t>(1, rays.size() / kPlaneRays);
  int least = std::numeric_limits<int>::max();
  std::size_t of_plane = 0;
  for (std::size_t i = 0; i < rays.size(); i += step) {
    for (std::size_t j = i + step; j < rays.size(); j += step) {
      const Vector3d across = rays[i].cross(rays[j]);
      constexpr double kParallel = 0.035;  // 2 degrees: no plane
      if (across.norm() < kParallel) continue;
      const Vector3d normal = across.normalized();
      const auto off = std::count_if(rays.begin(), rays.end(), [&](const Vector3d& ray) {
        return std::abs(ray.dot(normal)) > kOffPlane;
      });
      if (static_cast<int>(off) >= least) continue;
      least = static_cast<int>(off);
      plane = normal;
      of_plane = i;
    }
  }
  if (plane.isZero()) return;
  match.off_plane = least;
  if (least >= kEnough) return;
  const PlainMember& by = match.members[of_plane];
  const PlainView& first = views[by.view];
  const Vector3d line = first.Line(first.sights()[by.sight].slope);
  const auto stretch = StretchWithin(room, first.station().place, line);
  if (!stretch) return;
  int lonely = 0;
  std::vector<std::size_t> in_band;
  for (std::size_t k = 0; k < match.members.size(); ++k) {
    const PlainView& view = views[match.members[k].view];
    if (k == of_plane || std::abs(rays[k].dot(plane)) > kOffPlane) continue;
    const auto near = view.Predict(first.station().place + stretch->first * line);
    const auto far = view.Predict(first.station().place + stretch->second * line);
    if (!near || !far) continue;
    view.Along(
        near->slope, far->slope,
        kPlainBand * std::sqrt(first.usual_covariance().trace() + view.usual_covariance().trace()),
        in_band);
    if (in_band.size() <= 1) ++lonely;
  }
  match.lonely = std::max(lonely - 1, 0);  // one of them made the pair
}

}  // namespace trammel::part_alignment
