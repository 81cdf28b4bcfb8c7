#include "sim/spindle/spindle_ring.h"

#include <algorithm>
#include <cmath>
#include <numbers>

namespace trammel::sim {
namespace {

constexpr double kTurn = 2 * std::numbers::pi;

double HalfSquare(double t) { return t > 0 ? 0.5 * t * t : 0; }

/// What a straight edge leaves of a square of `side` px: the part where the distance, `inside_mm`
/// at the middle and growing along the direction (x, y) of the target's plane, is positive.
double Left(double inside_mm, double x, double y, double side,
            const std::array<std::array<double, 2>, 2>& by_pixel) {
  const double right = x * by_pixel[0][0] + y * by_pixel[1][0];  // mm per px
  const double down = x * by_pixel[0][1] + y * by_pixel[1][1];
  const double steepness = std::hypot(right, down);
  if (!(steepness > 0)) return inside_mm > 0 ? 1 : 0;
  const double distance = inside_mm / steepness;
  if (distance >= 0.71 * side) return 1;
  if (distance <= -0.71 * side) return 0;
  // The square's shadow along the edge's normal is a trapezium: two boxes, one after the other.
  const double a = std::max(std::abs(right) / steepness * side, 1e-6 * side);
  const double b = std::max(std::abs(down) / steepness * side, 1e-6 * side);
  const double half_sum = 0.5 * (a + b);
  const double half_gap = 0.5 * (a - b);
  const double left = HalfSquare(distance + half_sum) - HalfSquare(distance + half_gap) -
                      HalfSquare(distance - half_gap) + HalfSquare(distance - half_sum);
  return std::clamp(left / (a * b), 0.0, 1.0);
}

struct Square {
  double x = 0;
  double y = 0;
  double radius = 0;
  double side_px = 1;
  const PixelOnTarget* pixel = nullptr;

  [[nodiscard]] double Within(double radius_mm) const {
    if (!(radius > 0)) return 1;
    return Left(radius_mm - radius, -x / radius, -y / radius, side_px, pixel->by_pixel);
  }
  /// On the left-hand side of the ray from the middle at this angle.
  [[nodiscard]] double LeftOfRay(double angle_rad) const {
    const double c = std::cos(angle_rad);
    const double s = std::sin(angle_rad);
    return Left(c * y - s * x, -s, c, side_px, pixel->by_pixel);
  }
};

// The white part of the ring's segments, as if the ring had neither inner nor outer edge.
double WhiteSegments(const RingPattern& pattern, const Square& square) {
  const double sense = pattern.clockwise ? -1 : 1;
  const double angle = sense * std::atan2(square.y, square.x) - pattern.first_rad;
  const double width = kTurn / pattern.bits;
  const double at = (angle - kTurn * std::floor(angle / kTurn)) / width;
  const int here = std::min(static_cast<int>(at), pattern.bits - 1);
  const bool begins = at - here < 0.5;  // nearer to the segment's beginning than to its end
  const int next = (here + (begins ? pattern.bits - 1 : 1)) % pattern.bits;
  const auto bit = [&](int i) { return (pattern.word >> i & 1U) != 0; };
  if (bit(here) == bit(next)) return bit(here) ? 1 : 0;
  const double edge = sense * (pattern.first_rad + width * (here + (begins ? 0 : 1)));
  const double left = square.LeftOfRay(edge);
  const double inside = begins == !pattern.clockwise ? left : 1 - left;
  return bit(here) ? inside : 1 - inside;
}

double Hidden(const std::vector<HiddenWedge>& wedges, const Square& square) {
  double free = 1;
  for (const HiddenWedge& wedge : wedges) {
    const double inside = square.LeftOfRay(wedge.from_rad) *
                          (1 - square.LeftOfRay(wedge.from_rad + wedge.extent_rad)) *
                          (1 - square.Within(wedge.beyond_mm));
    free *= 1 - inside;
  }
  return 1 - free;
}

TargetCover CoverOfSquare(const RingPattern& pattern, const std::vector<HiddenWedge>& hidden,
                          const Square& square) {
  TargetCover cover;
  cover.target = square.Within(pattern.ground_radius_mm);
  cover.white = square.Within(pattern.dot_radius_mm);
  if (pattern.bits > 0) {
    const double ring = square.Within(pattern.ring_outer_mm) - square.Within(pattern.ring_inner_mm);
    if (ring > 0) cover.white += ring * WhiteSegments(pattern, square);
  }
  cover.hidden = hidden.empty() ? 0 : Hidden(hidden, square);
  return cover;
}

bool NearAnEdge(const RingPattern& pattern, bool hidden, double radius, double reach_mm) {
  if (hidden && radius < pattern.ground_radius_mm + reach_mm) return true;
  const auto near = [&](double edge) { return std::abs(radius - edge) < reach_mm; };
  if (near(pattern.dot_radius_mm) || near(pattern.ground_radius_mm)) return true;
  return pattern.bits > 0 && radius > pattern.ring_inner_mm - reach_mm &&
         radius < pattern.ring_outer_mm + reach_mm;
}

}  // namespace

TargetCover CoverOf(const RingPattern& pattern, const std::vector<HiddenWedge>& hidden,
                    const PixelOnTarget& pixel) {
  constexpr int kSplit = 4;
  const auto& by = pixel.by_pixel;
  Square square = {pixel.at_mm[0], pixel.at_mm[1], std::hypot(pixel.at_mm[0], pixel.at_mm[1]), 1,
                   &pixel};
  const double reach_mm = 0.5 * (std::hypot(by[0][0], by[1][0]) + std::hypot(by[0][1], by[1][1]));
  if (!NearAnEdge(pattern, !hidden.empty(), square.radius, reach_mm)) {
    return CoverOfSquare(pattern, hidden, square);
  }
  TargetCover sum;
  square.side_px = 1.0 / kSplit;
  for (int i = 0; i < kSplit; ++i) {
    const double down = (i + 0.5) / kSplit - 0.5;
    for (int j = 0; j < kSplit; ++j) {
      const double right = (j + 0.5) / kSplit - 0.5;
      square.x = pixel.at_mm[0] + by[0][0] * right + by[0][1] * down;
      square.y = pixel.at_mm[1] + by[1][0] * right + by[1][1] * down;
      square.radius = std::hypot(square.x, square.y);
      const TargetCover part = CoverOfSquare(pattern, hidden, square);
      sum.target += part.target;
      sum.white += part.white;
      sum.hidden += part.hidden;
    }
  }
  constexpr double kShare = 1.0 / (kSplit * kSplit);
  return {sum.target * kShare, sum.white * kShare, sum.hidden * kShare};
}

}  // namespace trammel::sim
