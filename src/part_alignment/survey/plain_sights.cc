#include "part_alignment/survey/plain_sights.h"

#include <Eigen/LU>
#include <algorithm>
#include <cmath>

#include "geometry/linear_systems.h"
#include "part_alignment/survey/survey_discs.h"

namespace trammel::part_alignment {
namespace {

using Eigen::Matrix2d;
using Eigen::Vector2d;
using Eigen::Vector3d;

Eigen::Matrix<double, 2, 3> SlopeByPoint(const Vector2d& slope, double depth) {
  Eigen::Matrix<double, 2, 3> by_point;
  by_point << 1 / depth, 0, -slope.x() / depth, 0, 1 / depth, -slope.y() / depth;
  return by_point;
}

// Of a turn before the camera, x -> x + turn x x.
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
    PlainSight sight;
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
  for (const PlainSight& sight : sights_) {
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
  // Cell by cell along the steeper axis, so that no point is met twice.
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
  const auto cell_of = [&](const PlainSight& sight) {
    const int x = CellsOf(sight.slope.x(), sight.slope.x(), 0).first;
    const int y = CellsOf(sight.slope.y(), sight.slope.y(), 1).first;
    return static_cast<std::size_t>(y * kCells + x);
  };
  begins_.assign(kCells * kCells + 1, 0);
  for (const PlainSight& sight : sights_) ++begins_[cell_of(sight) + 1];
  for (std::size_t i = 1; i < begins_.size(); ++i) begins_[i] += begins_[i - 1];
  std::vector<std::size_t> next(begins_.begin(), begins_.end() - 1);
  in_cells_.resize(sights_.size());
  for (std::size_t k = 0; k < sights_.size(); ++k) in_cells_[next[cell_of(sights_[k])]++] = k;
}

}  // namespace trammel::part_alignment
