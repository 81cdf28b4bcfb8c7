// The ellipse nearest to points, and even steps around it.
#pragma once

#include <array>
#include <cmath>
#include <cstddef>
#include <numbers>
#include <optional>
#include <span>

#include "part_alignment/targets/disc_fit.h"

namespace trammel::part_alignment {

struct Offset {
  double x = 0;
  double y = 0;
};

/// The ellipse nearest to points about (0, 0), by the conic's algebraic residual. Of a model only
/// centre and shape are set.
/// @param scale  about how far from (0, 0) the points are, px.
[[nodiscard]] std::optional<DiscModel> EllipseThrough(std::span<const Offset> points, double scale);

/// Root mean square of the points' distances from the ellipse, about.
[[nodiscard]] double DistanceFrom(const DiscModel& ellipse, std::span<const Offset> points);

/// So many directions at even steps of the angle, all around.
/// @param stride  from each to the next, in steps; without a divisor of kCount
template <std::size_t kCount>
std::array<Offset, kCount> AllAround(double first_rad, int stride = 1) {
  std::array<Offset, kCount> all;
  for (std::size_t i = 0; i < kCount; ++i) {
    const double angle =
        first_rad + 2 * std::numbers::pi * stride * static_cast<double>(i) / kCount;
    all[i] = {std::cos(angle), std::sin(angle)};
  }
  return all;
}

}  // namespace trammel::part_alignment
