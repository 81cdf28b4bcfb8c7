#include "tap/two_zone_press.h"

#include <algorithm>
#include <array>
#include <cmath>

#include "tap/break_search.h"

namespace trammel::tap {
namespace {

constexpr std::size_t kLeastPart = 3;  // samples of each zone
constexpr double kLeastRatio = 0.1;    // of the outer slope to the inner one
// Widths of the outer zone that are tried, of the depth; steps around the best, of its width, and
// by what they shrink where they lead nowhere.
constexpr std::array<double, 8> kWidths = {0.025, 0.05, 0.09, 0.15, 0.24, 0.36, 0.55, 0.8};
constexpr double kStep = 0.25;
constexpr double kShrink = 0.4;
constexpr int kMostSteps = 14;
constexpr double kParabolaShrink = 0.2;
constexpr double kLeastStep = 0.001;

// Breaks that are tried with kinks below them, two at a time.
struct Break {
  Break(const PressProfile& profile, double t)
      : below(profile.Below(t)), outer(profile.Outer(t, below)) {}

  std::size_t below;
  PressProfile::OuterZone outer;
};

// Sums of squares of the two; kNever where a zone is too short or does not press.
std::array<double, 2> TryTwo(const PressProfile& profile, const std::array<const Break*, 2>& breaks,
                             const std::array<double, 2>& s, TwoZonePress& best) {
  const std::array<std::size_t, 2> below = {profile.Below(s[0]), profile.Below(s[1])};
  const PressProfile::TwoZones at =
      profile.EvaluateTwoZones({&breaks[0]->outer, &breaks[1]->outer}, s, below);
  std::array<double, 2> costs = {kNever, kNever};
  for (std::size_t i = 0; i < costs.size(); ++i) {
    const double t = breaks[i]->outer.t;
    const double outer = at.outer_slope[i];
    const double inner = outer + at.added_slope[i];
    if (!(s[i] < t) || below[i] < kLeastPart || breaks[i]->below < below[i] + kLeastPart ||
        !(inner > 0 && outer >= kLeastRatio * inner)) {
      continue;
    }
    costs[i] = std::max(0.0, at.sum_squares_curved[i]);
    if (!best.found || costs[i] < best.sum_squares_curved) {
      const double straight = std::max(0.0, at.sum_squares[i]);
      best = {t, s[i], outer, inner, at.added_curve[i], straight, costs[i], true};
    }
  }
  return costs;
}

// Of the parabola through three points at 1 - step, 1 and 1 + step; 1 where it has no least.
double LeastOfParabola(double step, double below, double middle, double above) {
  const double curve = below - 2 * middle + above;
  return curve > 0 && curve < kNever ? 1 + 0.5 * step * (below - above) / curve : 1;
}

}  // namespace

TwoZonePress FitTwoZones(const PressProfile& profile, double t) {
  const Break end(profile, t);
  const auto try_two = [&](double first, double second, TwoZonePress& best) {
    return TryTwo(profile, {&end, &end}, {t * (1 - first), t * (1 - second)}, best);
  };
  TwoZonePress best;
  for (std::size_t i = 0; i < kWidths.size(); i += 2) {
    try_two(kWidths[i], kWidths[i + 1], best);
  }
  double step = kStep;
  for (int i = 0; best.found && i < kMostSteps && step > kLeastStep; ++i) {
    const TwoZonePress centre = best;
    const double width = 1 - centre.s / t;
    const auto [below, above] = try_two(width * (1 - step), width * (1 + step), best);
    if (best.s == centre.s) {
      const double to = LeastOfParabola(step, below, centre.sum_squares_curved, above);
      step *= kParabolaShrink;
      try_two(width * to, width * (to + (to > 1 ? -step : step)), best);
    }
  }
  return best;
}

namespace {

// Some steps of break and kink from a start, each in turn.
TwoZonePress Improve(const PressProfile& profile, TwoZonePress best) {
  constexpr int kSteps = 6;
  double step = kStep;
  for (int i = 0; best.found && i < kSteps; ++i) {
    const TwoZonePress centre = best;
    const double length = centre.t - centre.s;
    const Break nearer(profile, centre.t - step * length);
    const Break farther(profile, centre.t + step * length);
    TryTwo(profile, {&nearer, &farther}, {centre.s, centre.s}, best);
    const Break same(profile, centre.t);
    TryTwo(profile, {&same, &same}, {centre.s + step * length, centre.s - step * length}, best);
    step *= best.sum_squares_curved < centre.sum_squares_curved ? 1 : kShrink;
  }
  return best;
}

}  // namespace

TwoZonePress GuessTwoZones(const PressProfile& profile, double smooth_t) {
  // By how much of its width a zone ends beyond the smooth break: a stiff or a wide one near it, a
  // soft one behind.
  constexpr std::array<std::array<double, 2>, 2> kBeyond = {{{-0.15, 0}, {0.3, 0.8}}};
  TwoZonePress best;
  for (const std::array<double, 2>& kind : kBeyond) {
    TwoZonePress start;
    for (const double width : kWidths) {
      const Break first(profile, smooth_t * (1 + kind[0] * width));
      const Break second(profile, smooth_t * (1 + kind[1] * width));
      TryTwo(profile, {&first, &second},
             {first.outer.t * (1 - width), second.outer.t * (1 - width)}, start);
    }
    const TwoZonePress improved = Improve(profile, start);
    if (improved.found && (!best.found || improved.sum_squares_curved < best.sum_squares_curved)) {
      best = improved;
    }
  }
  return best;
}

}  // namespace trammel::tap
