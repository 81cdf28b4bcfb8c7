// The ellipse nearest to points, and even steps around it.
#pragma once

#include <array>
#include <cmath>
#include <cstddef>
#include <numbers>
#include <optional>
#include <span>

#include "part_alignment/targets/disc_fit.h"
#include "part_alignment/targets/four.h"
#include "part_alignment/targets/two.h"

namespace trammel::part_alignment {

struct Offset {
  double x = 0;
  double y = 0;
};

/// Sums of products of points' coordinates, up to the fourth degree: what the ellipse nearest to
/// the points by the conic's algebraic residual follows from.
class EllipseSums {
 public:
  /// @param x, y  about (0, 0), in a unit in which they are about 1.
  void Add(double x, double y);
  EllipseSums& operator+=(const EllipseSums& other);
  /// Centre and shape of a model, px. Absent where the points are on no ellipse.
  /// @param unit_px  of the coordinates.
  [[nodiscard]] std::optional<DiscModel> Ellipse(double unit_px) const;

 private:
  enum Sum : std::size_t {
    kX,
    kY,
    kXx,
    kXy,
    kYy,
    kXxx,
    kXxy,
    kXyy,
    kYyy,
    kXxxx,
    kXxxy,
    kXxyy,
    kXyyy,
    kYyyy,
    kCount
  };
  std::array<double, kCount> sums_{};
};

/// The ellipse nearest to points about (0, 0); `scale`: about how far from (0, 0) they are, px.
[[nodiscard]] std::optional<DiscModel> EllipseThrough(std::span<const Offset> points, double scale);

/// Root mean square of the points' distances from the ellipse, about.
[[nodiscard]] double DistanceFrom(const DiscModel& ellipse, std::span<const Offset> points);

/// Directions at even steps of the angle, each from the one before: right to 1e-13.
class Directions {
 public:
  Directions(double first_rad, double step_rad)
      : x_(std::cos(first_rad)),
        y_(std::sin(first_rad)),
        cos_(std::cos(step_rad)),
        sin_(std::sin(step_rad)) {}
  [[nodiscard]] double x() const { return x_; }
  [[nodiscard]] double y() const { return y_; }
  void Next() {
    const double x = x_ * cos_ - y_ * sin_;
    y_ = x_ * sin_ + y_ * cos_;
    x_ = x;
  }

 private:
  double x_;
  double y_;
  double cos_;
  double sin_;
};

/// So many of them, all around.
/// @param stride  from each to the next, in steps; without a divisor of kCount
template <std::size_t kCount>
std::array<Two, kCount> AllAround(double first_rad, int stride = 1) {
  std::array<Two, kCount> all;
  Directions direction(first_rad, stride * (2 * std::numbers::pi / kCount));
  for (Two& one : all) {
    one = Two{direction.x(), direction.y()};
    direction.Next();
  }
  return all;
}

/// The same, four at a time.
template <std::size_t kCount>
std::array<FourPlaces, kCount / 4> AroundByFour(double first_rad, int stride = 1) {
  std::array<FourPlaces, kCount / 4> all;
  const auto directions = AllAround<kCount>(first_rad, stride);
  for (std::size_t i = 0; i < kCount; ++i) {
    all[i / 4].x[i % 4] = directions[i][0];
    all[i / 4].y[i % 4] = directions[i][1];
  }
  return all;
}

}  // namespace trammel::part_alignment
