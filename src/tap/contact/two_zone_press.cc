#include "tap/contact/two_zone_press.h"

#include <algorithm>
#include <span>

namespace trammel::tap {
namespace {

// Widths of the outer zone that are tried, of the depth.
constexpr std::array<double, 8> kWidths = {0.025, 0.05, 0.09, 0.15, 0.24, 0.36, 0.55, 0.8};

// A column of the inner zone: its sum, that times y - mean, and its products with the outer zone's
// column and with the force.
struct Column {
  double sum = 0;
  double sum_y = 0;
  double by_outer = 0;
  double by_force = 0;
};

// Sums over the samples below s, of powers of s - y.
struct Kink {
  Kink(const PressProfile& profile, double at)
      : s(at),
        e(Shifted<5>(profile.Sums(profile.Below(at)).y, at)),
        force(Shifted<3>(profile.Sums(profile.Below(at)).force, at)) {}
  [[nodiscard]] Column Power(const OuterZone& outer, double mean_y, std::size_t i) const {
    return {e[i], (s - mean_y) * e[i] - e[i + 1], (outer.t - s) * e[i] + e[i + 1], force[i]};
  }

  double s;
  std::array<double, 5> e;
  std::array<double, 3> force;
};

// Solves for the columns k and q, whose products with each other are p11, p12 and p22.
TwoZones Solve(const PressProfile::Baseline& baseline, const OuterZone& outer, const Column& first,
               const Column& second, double p11, double p12, double p22) {
  // Eliminates the baseline and the outer column.
  const auto together = [&](double sum, double sum_y, const Column& other) {
    return baseline.inverse_count * sum * other.sum + baseline.inverse_spread * sum_y * other.sum_y;
  };
  const auto by_outer = [&](const Column& column) {
    return column.by_outer - together(outer.sum, outer.sum_y, column);
  };
  const double g12 = by_outer(first);
  const double g13 = by_outer(second);
  const auto by_force = [&](const Column& column, double outer_part) {
    return column.by_force - baseline.mean_force * column.sum - baseline.slope * column.sum_y -
           outer.slope * outer_part;
  };
  const double l12 = g12 * outer.inverse;
  const double l13 = g13 * outer.inverse;
  const double g22 = p11 - together(first.sum, first.sum_y, first) - l12 * g12;
  const double inverse = Invert(g22, p11);
  const double g23 = p12 - together(first.sum, first.sum_y, second) - l12 * g13;
  const double l23 = g23 * inverse;
  const double g33 = p22 - together(second.sum, second.sum_y, second) - l13 * g13 - l23 * g23;
  const double h2 = by_force(first, g12);
  const double h3 = by_force(second, g13) - l23 * h2;
  const double q = h3 * Invert(g33, p22);
  const double k = h2 * inverse - l23 * q;
  const double straight = outer.sum_squares - h2 * h2 * inverse;
  return {straight, straight - h3 * q, outer.slope - l12 * k - l13 * q, k, q};
}

// Not found where a zone is too short or does not press.
TwoZonePress PressAt(const PressProfile& profile, const OuterZone& outer, double s,
                     double rounding = 0) {
  constexpr double kMinRatio = 0.05;  // of the outer slope to the inner one
  if (!(s > outer.above && s <= outer.up_to)) {
    return {};
  }
  const double round = rounding * (outer.t - s);
  const TwoZones at = EvaluateTwoZones(profile, outer, s + round, s - round);
  const double inner = at.outer_slope + at.added_slope;
  if (!(inner > 0 && at.outer_slope >= kMinRatio * inner)) {
    return {};
  }
  return {outer.t,
          s,
          at.outer_slope,
          inner,
          at.added_curve,
          std::max(0.0, at.sum_squares),
          std::max(0.0, at.sum_squares_curved),
          true};
}

// Keeps the better of two presses.
void Keep(const TwoZonePress& press, TwoZonePress& best) {
  if (press.sum_squares_curved < best.sum_squares_curved) {
    best = press;
  }
}

}  // namespace

OuterZone::OuterZone(const PressProfile& profile, double break_t) : t(break_t) {
  constexpr std::size_t kMinPart = 3;  // samples of each zone
  const PressProfile::Baseline& baseline = profile.baseline();
  const std::size_t below = profile.Below(t);
  const auto d = Shifted<3>(profile.Sums(below).y, t);
  const auto f = Shifted<2>(profile.Sums(below).force, t);
  sum = d[1];
  sum_y = (t - baseline.mean_y) * d[1] - d[2];
  const double force = f[1] - baseline.mean_force * sum - baseline.slope * sum_y;
  inverse = Invert(
      d[2] - baseline.inverse_count * sum * sum - baseline.inverse_spread * sum_y * sum_y, d[2]);
  slope = force * inverse;
  sum_squares = baseline.sum_squares - force * slope;
  if (below >= 2 * kMinPart) {
    above = profile.samples().y[kMinPart - 1];
    up_to = profile.samples().y[below - kMinPart];
  }
}

TwoZones EvaluateTwoZones(const PressProfile& profile, const OuterZone& outer, double u, double v) {
  const PressProfile::Baseline& baseline = profile.baseline();
  const Kink end(profile, v);
  const Column square = end.Power(outer, baseline.mean_y, 2);
  if (!(u > v)) {
    return Solve(baseline, outer, end.Power(outer, baseline.mean_y, 1), square, end.e[2], end.e[3],
                 end.e[4]);
  }
  const Kink begin(profile, u);
  const Column h = begin.Power(outer, baseline.mean_y, 2);
  const double length = u - v;
  const double half = 0.5 / length;
  const Column ramp{half * (h.sum - square.sum), half * (h.sum_y - square.sum_y),
                    half * (h.by_outer - square.by_outer), half * (h.by_force - square.by_force)};
  const double squares = begin.e[4] - end.e[4] - 2 * length * (2 * end.e[3] + length * end.e[2]);
  return Solve(baseline, outer, ramp, square, half * half * squares,
               end.e[3] + 0.5 * length * end.e[2], end.e[4]);
}

TwoZonePress FitTwoZones(const PressProfile& profile, const OuterZone& outer, double near_s,
                         double rounding) {
  constexpr double kApart = 1.15;           // of a width, the next one that is tried
  constexpr double kEnoughOfWidth = 0.015;  // to which the least is searched
  const double t = outer.t;
  TwoZonePress best;
  const auto cost = [&](double width) {
    const TwoZonePress press = PressAt(profile, outer, t * (1 - width), rounding);
    Keep(press, best);
    return press.sum_squares_curved;
  };
  if (!(near_s > 0 && near_s < t) || cost(1 - near_s / t) == kNever) {
    for (const double width : kWidths) {
      cost(width);
    }
  }
  if (!best.found) {
    return best;
  }
  const auto at = [&cost](double width) { return Minimum{width, cost(width)}; };
  Minimum middle{1 - best.s / t, best.sum_squares_curved};
  Minimum narrower = at(middle.t / kApart);
  Minimum wider = at(middle.t * kApart);
  while (narrower.sum_squares < middle.sum_squares) {
    wider = middle;
    middle = narrower;
    narrower = at(middle.t / kApart);
  }
  while (wider.sum_squares < middle.sum_squares) {
    narrower = middle;
    middle = wider;
    wider = at(middle.t * kApart);
  }
  (void)FindMinimum(narrower, middle, wider, cost,
                    [&](double) { return kEnoughOfWidth * middle.t; });
  return best;
}

TwoZonePress GuessTwoZones(const PressProfile& profile, double smooth_t, ZonesStart start) {
  constexpr std::size_t kNarrowWidths = 3;
  // End of a zone beyond the smooth break, in parts of its width.
  constexpr std::array<double, 2> kStiffEnds = {-0.15, 0};
  constexpr std::array<double, 2> kSoftEnds = {0.3, 0.8};
  std::span<const double> widths = kWidths;
  if (start == ZonesStart::kNarrow) {
    widths = widths.first(kNarrowWidths);
  } else if (start == ZonesStart::kBeyond) {
    widths = widths.subspan(kNarrowWidths);
  }
  TwoZonePress best;
  const auto attempt = [&](double t, double s) {
    Keep(PressAt(profile, OuterZone(profile, t), s), best);
  };
  for (const double width : widths) {
    for (const double end : start == ZonesStart::kClose ? kStiffEnds : kSoftEnds) {
      const double t = smooth_t * (1 + end * width);
      attempt(t, t * (1 - width));
    }
  }
  // Some steps of break and kink from the best, each in turn.
  constexpr int kSteps = 4;
  constexpr double kShrink = 0.4;  // of a step that leads nowhere
  double step = 0.25;              // of the width
  for (int i = 0; best.found && i < kSteps; ++i) {
    const TwoZonePress centre = best;
    for (const double apart : {-step * (centre.t - centre.s), step * (centre.t - centre.s)}) {
      attempt(centre.t + apart, centre.s);
      attempt(centre.t, centre.s + apart);
    }
    step *= best.sum_squares_curved < centre.sum_squares_curved ? 1 : kShrink;
  }
  return best;
}

}  // namespace trammel::tap
