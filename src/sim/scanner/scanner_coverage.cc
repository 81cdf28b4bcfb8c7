#include "sim/scanner/scanner_coverage.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <numbers>

namespace trammel::sim {
namespace {

constexpr int kCapCorners = 7;
constexpr double kUprightPx = 1e-4;  // narrower pieces count as upright: wrong by half of that

PlaneMm Beside(const StrokePoint& point, const PlaneMm& along, double left_mm) {
  return {point.centre.x_mm - along.y_mm * left_mm, point.centre.y_mm + along.x_mm * left_mm};
}

// Half an ellipse around the stroke's end, from one edge to the other.
void AddCap(const StrokePoint& end, const PlaneMm& out, double first_mm, double second_mm,
            const ScannerMap& map, InkOutline& outline) {
  for (int i = 1; i <= kCapCorners; ++i) {
    const double angle_rad = std::numbers::pi * i / (kCapCorners + 1);
    const double side = std::cos(angle_rad);
    const double beside_mm = side * (side > 0 ? first_mm : second_mm);
    const double ahead_mm = std::sin(angle_rad) * (first_mm + second_mm) / 2;
    outline.corners.push_back(
        map.PixelOf({end.centre.x_mm + out.x_mm * ahead_mm - out.y_mm * beside_mm,
                     end.centre.y_mm + out.y_mm * ahead_mm + out.x_mm * beside_mm}));
  }
}

// The share of a pixel's pyramid to the right of an upright edge, `reach` being how far the
// pyramid's right end lies to the right of it; and the sum of these shares up to a reach.
double ShareRight(double reach) {
  if (reach <= 0) return 0;
  if (reach >= 2) return 1;
  return reach < 1 ? reach * reach / 2 : 1 - (2 - reach) * (2 - reach) / 2;
}

double SumOfShares(double reach) {
  if (reach <= 0) return 0;
  if (reach >= 2) return reach - 1;
  const double left = 2 - reach;
  return reach < 1 ? reach * reach * reach / 6 : reach - 1 + left * left * left / 6;
}

}  // namespace

InkOutline OutlineOf(const InkStroke& stroke, const ScannerMap& map) {
  InkOutline outline;
  outline.ink = stroke.ink;
  outline.raised = stroke.raised;
  const std::vector<StrokePoint>& points = stroke.points;
  const PlaneMm back{-stroke.along.x_mm, -stroke.along.y_mm};
  outline.corners.reserve(2 * points.size() + 2 * kCapCorners);
  for (const StrokePoint& point : points) {
    outline.corners.push_back(map.PixelOf(Beside(point, stroke.along, point.left_mm)));
  }
  AddCap(points.back(), stroke.along, points.back().left_mm, points.back().right_mm, map, outline);
  for (auto point = points.rbegin(); point != points.rend(); ++point) {
    outline.corners.push_back(map.PixelOf(Beside(*point, stroke.along, -point->right_mm)));
  }
  AddCap(points.front(), back, points.front().right_mm, points.front().left_mm, map, outline);

  // Seen with y up the outline runs clockwise; a mirrored picture turns it round.
  outline.weight = map.keeps_handedness() ? -stroke.opacity : stroke.opacity;
  constexpr double kFar = std::numeric_limits<double>::infinity();
  outline.top_px = outline.left_px = kFar;
  outline.bottom_px = outline.right_px = -kFar;
  for (const PixelPlace& corner : outline.corners) {
    outline.top_px = std::min(outline.top_px, corner.y_px);
    outline.bottom_px = std::max(outline.bottom_px, corner.y_px);
    outline.left_px = std::min(outline.left_px, corner.x_px);
    outline.right_px = std::max(outline.right_px, corner.x_px);
  }
  return outline;
}

void CoverageRows::Reset(int first_row, int rows, int width) {
  first_row_ = first_row;
  rows_ = rows;
  width_ = static_cast<std::size_t>(width);
  begin_ = width;
  end_ = 0;
  stride_ = width_ + 3 * kPad;
  values_.assign(stride_ * static_cast<std::size_t>(rows), 0.0F);
}

void CoverageRows::Add(const InkOutline& outline) {
  if (outline.bottom_px + kReachPx <= first_row_ ||
      outline.top_px - kReachPx >= first_row_ + rows_) {
    return;
  }
  const auto column = [this](double x_px) {
    return static_cast<int>(std::clamp(x_px, 0.0, static_cast<double>(width_)));
  };
  begin_ = std::min(begin_, column(std::floor(outline.left_px) - kReachPx));
  end_ = std::max(end_, column(std::ceil(outline.right_px) + kReachPx + 1));
  PixelPlace last = outline.corners.back();
  for (const PixelPlace& corner : outline.corners) {
    AddEdge(last, corner, outline.weight);
    last = corner;
  }
}

void CoverageRows::AddEdge(PixelPlace from, PixelPlace to, double weight) {
  if (from.y_px == to.y_px) return;
  if (from.y_px > to.y_px) {
    std::swap(from, to);
    weight = -weight;
  }
  const double slope = (to.x_px - from.x_px) / (to.y_px - from.y_px);
  const double top = std::max(from.y_px - first_row_, -1.0);
  const double bottom = std::min(to.y_px - first_row_, rows_ + 1.0);
  // Seen from here, rows are counted in quarters from one row above the first.
  double y = top;
  int quarter = static_cast<int>((top + 1) * 4);
  while (y < bottom) {
    const double next_y = std::min(bottom, (quarter + 1) / 4.0 - 1);
    const double x = from.x_px + (y + first_row_ - from.y_px) * slope;
    const double next_x = from.x_px + (next_y + first_row_ - from.y_px) * slope;
    AddStep(x, next_x, quarter, weight * (next_y - y));
    y = next_y;
    ++quarter;
  }
}

// A piece of an edge within a quarter of a row covers what lies to its right, `height` high. It is
// seen by its own row and by the nearer of the rows beside it.
void CoverageRows::AddStep(double x_px, double next_x_px, int quarter, double height) {
  constexpr std::array<double, 4> kOwn = {5.0 / 8, 7.0 / 8, 7.0 / 8, 5.0 / 8};
  const int part = quarter % 4;
  const int own_row = quarter / 4 - 1;
  const int other_row = part < 2 ? own_row - 1 : own_row + 1;
  const auto row_of = [this](int row) {
    return row < 0 || row >= rows_
               ? nullptr
               : values_.data() + static_cast<std::size_t>(row) * stride_ + kPad;
  };
  float* own = row_of(own_row);
  float* other = row_of(other_row);
  const double own_height = height * kOwn[static_cast<std::size_t>(part)];
  const double last_px = static_cast<double>(width_) + 1;
  const double left = std::clamp(std::min(x_px, next_x_px), -1.0, last_px);
  const double right = std::clamp(std::max(x_px, next_x_px), -1.0, last_px);
  const double per_px = right - left < kUprightPx ? 0 : 1 / (right - left);
  double before = 0;
  for (int pixel = static_cast<int>(std::floor(left - 0.5)); before < 1; ++pixel) {
    const double reach = pixel + 1.5 - left;
    double share = 1;
    if (pixel + 1.5 - right < 2) {
      share = per_px == 0 ? ShareRight(reach)
                          : (SumOfShares(reach) - SumOfShares(pixel + 1.5 - right)) * per_px;
    }
    if (own != nullptr) own[pixel] += static_cast<float>(own_height * (share - before));
    if (other != nullptr)
      other[pixel] += static_cast<float>((height - own_height) * (share - before));
    before = share;
  }
}

void CoverageRows::Sum() {
  for (int index = 0; index < rows_; ++index) {
    float* row = values_.data() + static_cast<std::size_t>(index) * stride_ + kPad;
    float sum = row[-2] + row[-1];
    for (int x = begin_; x < end_; ++x) {
      sum += row[x];
      row[x] = std::clamp(sum, 0.0F, 1.0F);
    }
  }
}

}  // namespace trammel::sim
