// Least squares of the press in two zones: two presses side by side, which a processor works out at
// once. Defined here, because nearly half of what a tap costs goes through it.
#pragma once

#include <array>
#include <cstddef>
#include <limits>

#include "tap/contact/moments.h"
#include "tap/contact/press_profile.h"

namespace trammel::tap {

/// Two outer zones, which end at the breaks t: what kinks below them need to know of their columns
/// max(0, t - y), the baseline taken out, and of the baseline.
struct OuterZones {
  Pair t;
  Pair inverse;      ///< Of the column's sum of squares.
  Pair slope;        ///< Of the press without an inner zone,
  Pair sum_squares;  ///< and what it leaves.
  /// The column's product with (s - y)^i: (lever - s lift) times the sum of these, and lift times
  /// that of (s - y)^(i + 1).
  Pair lever, lift;
  /// Force at y = 0 and slope of the baseline beside such a press, both for the share of the outer
  /// column that a column of the inner zone takes along.
  Pair level, drift;
  Pair mean_y, inverse_count, inverse_spread;  ///< As the baseline has them.

  [[nodiscard]] Pair ByOuter(const Pair& s, const Pair& sum, const Pair& next) const {
    return (lever - s * lift) * sum + lift * next;
  }
  /// The force that baseline and outer zone do not explain, times (s - y)^i.
  [[nodiscard]] Pair Force(const Pair& s, const Pair& force, const Pair& sum,
                           const Pair& next) const {
    return force - (level + drift * s) * sum + drift * next;
  }
};

/// The press c max(0, t - y) + k e + q e^2, e = max(0, s - y), s < t: the outer zone straight.
struct TwoZones {
  Pair sum_squares;         ///< With q = 0, >= 0 but for rounding,
  Pair sum_squares_curved;  ///< and with q as it comes.
  Pair outer_slope;         ///< c, with q as it comes,
  Pair added_slope;         ///< k
  Pair added_curve;         ///< and q.
};

/// The two columns of inner zones: their sums, those times y - mean, their products with the outer
/// zone's column and with the force, without the baseline and the outer zone, and with each other.
struct InnerZones {
  std::array<Pair, 2> sum;
  std::array<Pair, 2> sum_y;
  std::array<Pair, 2> by_outer;
  std::array<Pair, 2> force;
  Pair p11, p12, p22;
};

/// @param below  Samples with y < t.
[[nodiscard]] inline OuterZones TakeOuterZones(const PressProfile& profile, const Pair& t,
                                               const std::array<std::size_t, 2>& below) {
  const PressProfile::Baseline& baseline = profile.baseline();
  const auto [first, second] = below;
  const auto d = Shifted<3>(profile.Sums(first).y, profile.Sums(second).y, t);
  const auto f = Shifted<2>(profile.Sums(first).force, profile.Sums(second).force, t);
  const Pair sum_y = (t - baseline.mean_y) * d[1] - d[2];
  const Pair mean = baseline.inverse_count * d[1];
  const Pair mean_slope = baseline.inverse_spread * sum_y;
  const Pair force = f[1] - baseline.mean_force * d[1] - baseline.slope * sum_y;
  OuterZones outer;
  outer.t = t;
  outer.inverse = Invert(d[2] - mean * d[1] - mean_slope * sum_y, d[2]);
  outer.slope = force * outer.inverse;
  outer.sum_squares = baseline.sum_squares - force * outer.slope;
  outer.lift = 1 + mean_slope;
  outer.lever = t - mean + mean_slope * baseline.mean_y;
  outer.drift = baseline.slope - outer.lift * outer.slope;
  outer.level = baseline.mean_force - baseline.slope * baseline.mean_y + outer.lever * outer.slope;
  outer.mean_y = Pair{} + baseline.mean_y;
  outer.inverse_count = Pair{} + baseline.inverse_count;
  outer.inverse_spread = Pair{} + baseline.inverse_spread;
  return outer;
}

/// Two breaks that kinks are tried below, side by side.
struct Breaks {
  Breaks(const PressProfile& profile, const Pair& t) : Breaks(profile, t, profile.Below(t)) {}
  /// The same twice.
  Breaks(const PressProfile& profile, double t) : Breaks(profile, Pair{t, t}) {}

  OuterZones outer;
  /// Kinks between these leave samples enough to either zone.
  Pair above = {kNone, kNone};
  Pair up_to = {0, 0};

 private:
  static constexpr std::size_t kLeastPart = 3;  // samples of each zone
  static constexpr double kNone = std::numeric_limits<double>::infinity();

  Breaks(const PressProfile& profile, const Pair& t, const std::array<std::size_t, 2>& below)
      : outer(TakeOuterZones(profile, t, below)) {
    for (std::size_t i = 0; i < below.size(); ++i) {
      if (below[i] >= 2 * kLeastPart) {
        above[i] = profile.samples().y[kLeastPart - 1];
        up_to[i] = profile.samples().y[below[i] - kLeastPart];
      }
    }
  }
};

/// Both unknowns of the inner zone come out of one division, by the determinant: a pivot after the
/// other would have to wait for two.
[[nodiscard, gnu::always_inline]] inline TwoZones Solve(const OuterZones& outer,
                                                        const InnerZones& inner) {
  // Without the baseline and the outer column.
  const auto& [sum1, sum2] = inner.sum;
  const auto& [sum_y1, sum_y2] = inner.sum_y;
  const auto& [g12, g13] = inner.by_outer;
  const Pair l12 = g12 * outer.inverse;
  const Pair l13 = g13 * outer.inverse;
  const Pair mean1 = outer.inverse_count * sum1;
  const Pair mean_slope1 = outer.inverse_spread * sum_y1;
  const Pair g22 = inner.p11 - mean1 * sum1 - mean_slope1 * sum_y1 - l12 * g12;
  const Pair g23 = inner.p12 - mean1 * sum2 - mean_slope1 * sum_y2 - l12 * g13;
  const Pair g33 = inner.p22 - outer.inverse_count * sum2 * sum2 -
                   outer.inverse_spread * sum_y2 * sum_y2 - l13 * g13;
  const auto& [h2, h3] = inner.force;
  const Pair none = {0, 0};
  const auto bends = g22 > kLeastPivot * inner.p11;
  const Pair pivot = bends ? g22 : Pair{1, 1};
  const Pair cross = bends ? g23 : none;
  const Pair force = bends ? h2 : none;
  const Pair determinant = pivot * g33 - cross * cross;
  const auto curves = determinant > kLeastPivot * inner.p22 * pivot;
  const Pair inverse = 1 / determinant;
  const Pair straight_k = force / pivot;
  const Pair q = curves ? (pivot * h3 - cross * force) * inverse : none;
  const Pair k = curves ? (g33 * force - cross * h3) * inverse : straight_k;
  const Pair c = outer.slope - l12 * k - l13 * q;
  const Pair straight = outer.sum_squares - force * straight_k;
  return {straight, straight - (h3 - cross * straight_k) * q, c, k, q};
}

/// Kinks at s.
[[nodiscard, gnu::always_inline]] inline TwoZones EvaluateTwoZones(const PressProfile& profile,
                                                                   const OuterZones& outer,
                                                                   const Pair& s) {
  const auto [first, second] = profile.Below(s);
  const auto e = Shifted<5>(profile.Sums(first).y, profile.Sums(second).y, s);
  const auto f = Shifted<3>(profile.Sums(first).force, profile.Sums(second).force, s);
  const Pair y = s - outer.mean_y;
  return Solve(outer, {{e[1], e[2]},
                       {y * e[1] - e[2], y * e[2] - e[3]},
                       {outer.ByOuter(s, e[1], e[2]), outer.ByOuter(s, e[2], e[3])},
                       {outer.Force(s, f[1], e[1], e[2]), outer.Force(s, f[2], e[2], e[3])},
                       e[2],
                       e[3],
                       e[4]});
}

/// Kinks that are rounded from u to v, v < u <= t, between which the slope changes evenly:
/// k (h^2 - e^2) / (2 (u - v)) + q e^2, h = max(0, u - y), e = max(0, v - y).
[[nodiscard, gnu::always_inline]] inline TwoZones EvaluateRounded(const PressProfile& profile,
                                                                  const OuterZones& outer,
                                                                  const Pair& u, const Pair& v) {
  const auto below_u = profile.Below(u);
  const auto below_v = profile.Below(v);
  const std::array<const Moments*, 2> at_u = {&profile.Sums(below_u[0]), &profile.Sums(below_u[1])};
  const std::array<const Moments*, 2> at_v = {&profile.Sums(below_v[0]), &profile.Sums(below_v[1])};
  const auto h = Shifted<5>(at_u[0]->y, at_u[1]->y, u);
  const auto e = Shifted<5>(at_v[0]->y, at_v[1]->y, v);
  const auto f_h = Shifted<3>(at_u[0]->force, at_u[1]->force, u);
  const auto f_e = Shifted<3>(at_v[0]->force, at_v[1]->force, v);
  const Pair length = u - v;
  const Pair half = 0.5 / length;
  const Pair sum_y = (v - outer.mean_y) * e[2] - e[3];
  const Pair by_outer = outer.ByOuter(v, e[2], e[3]);
  const Pair force = outer.Force(v, f_e[2], e[2], e[3]);
  const Pair squares = h[4] - e[4] - 2 * length * (2 * e[3] + length * e[2]);
  return Solve(outer, {{half * (h[2] - e[2]), e[2]},
                       {half * ((u - outer.mean_y) * h[2] - h[3] - sum_y), sum_y},
                       {half * (outer.ByOuter(u, h[2], h[3]) - by_outer), by_outer},
                       {half * (outer.Force(u, f_h[2], h[2], h[3]) - force), force},
                       half * half * squares,
                       e[3] + 0.5 * length * e[2],
                       e[4]});
}

}  // namespace trammel::tap
