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
#include "part_alignment/targets/small_cholesky.h"
#include "part_alignment/targets/two.h"

namespace trammel::part_alignment {

struct Offset {
  double x = 0;
  double y = 0;
};

/// Centres and shapes of ellipses, px. The other members of a model are not theirs.
/// @tparam Number  a double, or FourDoubles of four ellipses.
template <typename Number>
struct EllipsesOf {
  Number column_px;
  Number row_px;
  Number wxx;
  Number wxy;
  Number wyy;
  Mask<Number> are;  ///< whether there is one; anything else where not
};

/// The k-th of four.
[[gnu::always_inline]] inline EllipsesOf<double> OneOf(const EllipsesOf<FourDoubles>& of, int k) {
  return {of.column_px[k], of.row_px[k], of.wxx[k], of.wxy[k], of.wyy[k], of.are[k] != 0};
}

[[gnu::always_inline]] inline DiscModel ModelOf(const EllipsesOf<double>& ellipse) {
  DiscModel disc;
  disc.column_px = ellipse.column_px;
  disc.row_px = ellipse.row_px;
  disc.wxx = ellipse.wxx;
  disc.wxy = ellipse.wxy;
  disc.wyy = ellipse.wyy;
  return disc;
}

/// Sums of products of points' coordinates, up to the fourth degree: what the ellipse nearest to
/// the points by the conic's algebraic residual follows from.
/// @tparam Number  a double, or FourDoubles of four ellipses.
template <typename Number>
class EllipseSumsOf {
 public:
  static constexpr std::size_t kCount = 14;
  /// @param x, y  about (0, 0), in a unit in which they are about 1.
  [[gnu::always_inline]] inline void Add(Number x, Number y) {
    const Number xx = x * x;
    const Number xy = x * y;
    const Number yy = y * y;
    sums_[kX] += x;
    sums_[kY] += y;
    sums_[kXx] += xx;
    sums_[kXy] += xy;
    sums_[kYy] += yy;
    sums_[kXxx] += x * xx;
    sums_[kXxy] += x * xy;
    sums_[kXyy] += x * yy;
    sums_[kYyy] += y * yy;
    sums_[kXxxx] += xx * xx;
    sums_[kXxxy] += xx * xy;
    sums_[kXxyy] += xx * yy;
    sums_[kXyyy] += xy * yy;
    sums_[kYyyy] += yy * yy;
  }
  [[nodiscard]] Number& operator[](std::size_t i) { return sums_[i]; }
  /// @param unit_px  of the coordinates.
  [[nodiscard, gnu::always_inline]] inline EllipsesOf<Number> Ellipses(double unit_px) const {
    // a x² + 2 b x y + c y² + d x + e y = 1
    const auto& s = sums_;
    SmallMatrix<5, Number> normal{};
    normal[0] = {s[kXxxx]};
    normal[1] = {2 * s[kXxxy], 4 * s[kXxyy]};
    normal[2] = {s[kXxyy], 2 * s[kXyyy], s[kYyyy]};
    normal[3] = {s[kXxx], 2 * s[kXxy], s[kXyy], s[kXx]};
    normal[4] = {s[kXxy], 2 * s[kXyy], s[kYyy], s[kXy], s[kYy]};
    EllipsesOf<Number> ellipses{};
    ellipses.are = Factor(normal);
    if (!Any(ellipses.are)) return ellipses;
    const SmallVector<5, Number> right = {s[kXx], 2 * s[kXy], s[kYy], s[kX], s[kY]};
    const auto [a, b, c, d, e] = SolveFactored(normal, right);
    const Number det = a * c - b * b;
    ellipses.are &= (a > 0) & (det > 0);
    if (!Any(ellipses.are)) return ellipses;
    const Number cx = -(c * d - b * e) / (2 * det);
    const Number cy = -(a * e - b * d) / (2 * det);
    const Number level = 1 + a * cx * cx + 2 * b * cx * cy + c * cy * cy;
    // W is the square root of the form: (A + sqrt(det) I) / sqrt(trace + 2 sqrt(det)).
    const Number root = Root(det);
    const Number norm = Root((a + c + 2 * root) * level) * unit_px;
    ellipses.column_px = cx * unit_px;
    ellipses.row_px = cy * unit_px;
    ellipses.wxx = (a + root) / norm;
    ellipses.wxy = b / norm;
    ellipses.wyy = (c + root) / norm;
    return ellipses;
  }

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
  };
  std::array<Number, kCount> sums_{};
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
