#include "gcode/footprint.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include "base/check.h"

namespace trammel::gcode {
namespace {

constexpr int kMostCells = 2000;  // along a side of the plate

}  // namespace

Footprint::Footprint(const PlateArea& plate) : plate_(plate) {
  const double width_mm = plate.max_x_mm - plate.min_x_mm;
  const double depth_mm = plate.max_y_mm - plate.min_y_mm;
  TRAMMEL_CHECK(width_mm > 0 && depth_mm > 0 && std::isfinite(width_mm + depth_mm), "{} x {} mm",
                width_mm, depth_mm);
  cell_mm_ = std::max({1.0, width_mm / kMostCells, depth_mm / kMostCells});
  columns_ = static_cast<int>(std::ceil(width_mm / cell_mm_));
  rows_ = static_cast<int>(std::ceil(depth_mm / cell_mm_));
  cells_.assign(static_cast<std::size_t>(columns_) * static_cast<std::size_t>(rows_), 0);
}

std::size_t Footprint::Mark(double from_x_mm, double from_y_mm, double to_x_mm, double to_y_mm) {
  TRAMMEL_CHECK(std::isfinite(from_x_mm + from_y_mm + to_x_mm + to_y_mm), "({}, {}) to ({}, {})",
                from_x_mm, from_y_mm, to_x_mm, to_y_mm);
  // The part of the line on the plate, from 0 to 1 (Liang and Barsky 1984).
  double lo = 0;
  double hi = 1;
  const double dx = to_x_mm - from_x_mm;
  const double dy = to_y_mm - from_y_mm;
  for (const auto& [along, room] :
       {std::pair{-dx, from_x_mm - plate_.min_x_mm}, std::pair{dx, plate_.max_x_mm - from_x_mm},
        std::pair{-dy, from_y_mm - plate_.min_y_mm}, std::pair{dy, plate_.max_y_mm - from_y_mm}}) {
    if (along == 0) {
      if (room < 0) return 1;
    } else if (along < 0) {
      lo = std::max(lo, room / along);
    } else {
      hi = std::min(hi, room / along);
    }
  }
  if (lo > hi) return 1;
  sums_.clear();
  const double length_mm = (hi - lo) * std::hypot(dx, dy);
  const int steps = std::max(1, static_cast<int>(std::ceil(2 * length_mm / cell_mm_)));
  for (int i = 0; i <= steps; ++i) {
    const double at = lo + (hi - lo) * i / steps;
    const double x = (from_x_mm + at * dx - plate_.min_x_mm) / cell_mm_;
    const double y = (from_y_mm + at * dy - plate_.min_y_mm) / cell_mm_;
    const int column = std::clamp(static_cast<int>(std::floor(x)), 0, columns_ - 1);
    const int row = std::clamp(static_cast<int>(std::floor(y)), 0, rows_ - 1);
    cells_[static_cast<std::size_t>(row) * static_cast<std::size_t>(columns_) +
           static_cast<std::size_t>(column)] = 1;
  }
  return static_cast<std::size_t>(steps) + 1;
}

void Footprint::Sum() const {
  const auto width = static_cast<std::size_t>(columns_) + 1;
  sums_.assign(width * (static_cast<std::size_t>(rows_) + 1), 0);
  for (std::size_t y = 0; y + 1 < sums_.size() / width; ++y) {
    for (std::size_t x = 0; x + 1 < width; ++x) {
      sums_[(y + 1) * width + x + 1] = sums_[y * width + x + 1] + sums_[(y + 1) * width + x] -
                                       sums_[y * width + x] + cells_[y * (width - 1) + x];
    }
  }
}

bool Footprint::Clear(const PlateArea& area) const {
  if (sums_.empty()) Sum();
  const auto cell = [&](double at_mm, double origin_mm, int most) {
    return static_cast<std::size_t>(
        std::clamp(std::floor((at_mm - origin_mm) / cell_mm_), 0.0, static_cast<double>(most)));
  };
  const std::size_t left = cell(area.min_x_mm, plate_.min_x_mm, columns_ - 1);
  const std::size_t front = cell(area.min_y_mm, plate_.min_y_mm, rows_ - 1);
  const std::size_t right = cell(area.max_x_mm, plate_.min_x_mm, columns_ - 1) + 1;
  const std::size_t back = cell(area.max_y_mm, plate_.min_y_mm, rows_ - 1) + 1;
  const auto width = static_cast<std::size_t>(columns_) + 1;
  return sums_[back * width + right] + sums_[front * width + left] ==
         sums_[front * width + right] + sums_[back * width + left];
}

std::optional<PlateArea> Footprint::Bounds() const {
  int left = columns_, right = -1, front = rows_, back = -1;
  for (int y = 0; y < rows_; ++y) {
    for (int x = 0; x < columns_; ++x) {
      if (cells_[static_cast<std::size_t>(y) * static_cast<std::size_t>(columns_) +
                 static_cast<std::size_t>(x)] == 0) {
        continue;
      }
      left = std::min(left, x);
      right = std::max(right, x);
      front = std::min(front, y);
      back = std::max(back, y);
    }
  }
  if (right < 0) return std::nullopt;
  return PlateArea{plate_.min_x_mm + left * cell_mm_, plate_.min_y_mm + front * cell_mm_,
                   plate_.min_x_mm + (right + 1) * cell_mm_,
                   plate_.min_y_mm + (back + 1) * cell_mm_};
}

}  // namespace trammel::gcode
