#include "tap/contact/two_zone_press.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <span>

#include "tap/contact/break_search.h"

namespace trammel::tap {
namespace {

constexpr std::size_t kLeastPart = 3;  // samples of each zone
constexpr double kLeastRatio = 0.05;   // of the outer slope to the inner one
// Widths of the outer zone that are tried, of the depth; steps around the best, of its width, and
// by what they shrink where they lead nowhere.
constexpr std::array<double, 8> kWidths = {0.025, 0.05, 0.09, 0.15, 0.24, 0.36, 0.55, 0.8};
constexpr double kStep = 0.25;
constexpr double kShrink = 0.4;
constexpr int kMostSteps = 14;
// From a kink close by: the second width that is tried, the first step from there, which doubles,
// and the longest to less.
constexpr double kSlightlyWider = 1.15;
constexpr double kNearStep = 0.15;
constexpr double kMostNarrower = 0.4;
// Between two widths that cost more: how far from the least is near, of the way to its neighbour,
// how much farther than the parabola's least is looked, and how far towards what is not allowed.
constexpr double kNear = 0.1;
constexpr double kBeyond = 0.2;
constexpr double kTowardsEdge = 0.4;
// To a hundredth of the noise variance, or to a thousandth of the width.
constexpr double kEnough = 0.01;
constexpr int kLeastRounds = 1;
constexpr double kLeastStep = 0.001;
// By which less may be found than a parabola promises.
constexpr double kSurprise = 6;

// Breaks that are tried with kinks below them, two at a time.
struct Break {
  Break(const PressProfile& profile, double t) : Break(profile, t, profile.Below(t)) {}

  PressProfile::OuterZone outer;
  // Kinks between these leave samples enough to either zone.
  double above = kNever;
  double up_to = 0;

 private:
  Break(const PressProfile& profile, double t, std::size_t below) : outer(profile.Outer(t, below)) {
    if (below >= 2 * kLeastPart) {
      above = profile.samples().y[kLeastPart - 1];
      up_to = profile.samples().y[below - kLeastPart];
    }
  }
};

// Sums of squares of the two; kNever where a zone is too short or does not press.
std::array<double, 2> TryTwo(const PressProfile& profile, const std::array<const Break*, 2>& breaks,
                             const std::array<double, 2>& s, TwoZonePress& best,
                             double rounding = 0) {
  const std::array<const PressProfile::OuterZone*, 2> outer_zones = {&breaks[0]->outer,
                                                                     &breaks[1]->outer};
  const auto round = [&](std::size_t i) { return rounding * (outer_zones[i]->t - s[i]); };
  const PressProfile::TwoZones at =
      rounding > 0 ? profile.EvaluateRounded(outer_zones, {s[0] + round(0), s[1] + round(1)},
                                             {s[0] - round(0), s[1] - round(1)})
                   : profile.EvaluateTwoZones(outer_zones, s);
  // Without branches: which one is better nobody can predict.
  const Pair kink = {s[0], s[1]};
  const Pair above = {breaks[0]->above, breaks[1]->above};
  const Pair up_to = {breaks[0]->up_to, breaks[1]->up_to};
  const Pair inner = at.outer_slope + at.added_slope;
  const auto allowed =
      (kink > above) & (kink <= up_to) & (inner > 0) & (at.outer_slope >= kLeastRatio * inner);
  const Pair least = at.sum_squares_curved > 0 ? at.sum_squares_curved : Pair{};
  const Pair costs = allowed ? least : Pair{kNever, kNever};
  const std::size_t i = costs[1] < costs[0] ? 1 : 0;
  const TwoZonePress better = {breaks[i]->outer.t, s[i],
                               at.outer_slope[i],  inner[i],
                               at.added_curve[i],  std::max(0.0, at.sum_squares[i]),
                               costs[i],           costs[i] < kNever};
  best = std::min(best, better, [](const TwoZonePress& one, const TwoZonePress& other) {
    return one.sum_squares_curved < other.sum_squares_curved;
  });
  return {costs[0], costs[1]};
}

// A width of the outer zone, of the depth, and what it costs.
struct Width {
  double of_depth = 0;
  double cost = kNever;
};

// A least between its neighbours, which may be out of the question.
struct Bracket {
  Width below, least, above;

  [[nodiscard]] double Left() const { return least.of_depth - below.of_depth; }
  [[nodiscard]] double Right() const { return above.of_depth - least.of_depth; }
  void Take(const Width& width) {
    if (!(width.of_depth > below.of_depth && width.of_depth < above.of_depth)) {
      return;
    }
    const bool narrower = width.of_depth < least.of_depth;
    if (width.cost < least.cost) {
      (narrower ? above : below) = least;
      least = width;
    } else {
      (narrower ? below : above) = width;
    }
  }
};

Bracket Between(const Width& one, const Width& least, const Width& other) {
  return one.of_depth < other.of_depth ? Bracket{one, least, other} : Bracket{other, least, one};
}

// Where next to a least a lower one is expected, and by how much lower: of the parabola through the
// three; where a neighbour is out of the question, of the line from the other.
struct Expected {
  double apart = 0;
  double gain = 0;
};

Expected Expect(const Bracket& bracket) {
  const double left = bracket.Left();
  const double right = bracket.Right();
  const double to_left = (bracket.below.cost - bracket.least.cost) / left;
  const double to_right = (bracket.above.cost - bracket.least.cost) / right;
  if (to_left == kNever || to_right == kNever) {
    const bool leftwards = to_left == kNever;
    return {leftwards ? -kTowardsEdge * left : kTowardsEdge * right,
            leftwards ? to_right * left : to_left * right};
  }
  const double sum = to_left + to_right;
  const double apart = sum > 0 ? 0.5 * (to_left * right - to_right * left) / sum : 0;
  return {apart, sum / (left + right) * apart * apart};
}

// The search for the best kink below a break, along the width of the outer zone.
class KinkSearch {
 public:
  KinkSearch(const PressProfile& profile, double t, double rounding)
      : profile_(profile), end_(profile, t), rounding_(rounding) {}

  [[nodiscard]] const TwoZonePress& best() const { return best_; }
  std::array<Width, 2> Try(double first, double second) {
    const double t = end_.outer.t;
    const std::array<double, 2> costs =
        TryTwo(profile_, {&end_, &end_}, {t * (1 - first), t * (1 - second)}, best_, rounding_);
    return {{{first, costs[0]}, {second, costs[1]}}};
  }
  // Goes down from the better of two widths, while less than that is to be expected.
  void Refine(const Width& one, const Width& other, double of_interest) {
    const auto samples = static_cast<double>(profile_.samples().y.size());
    Bracket bracket = one.cost < other.cost ? Enclose(other, one) : Enclose(one, other);
    for (int i = 0; i < kMostSteps; ++i) {
      const Expected expected = Expect(bracket);
      const double shortest = kLeastStep * bracket.least.of_depth;
      if (bracket.least.cost - kSurprise * expected.gain > of_interest ||
          (i >= kLeastRounds && expected.gain < kEnough * bracket.least.cost / samples) ||
          !(bracket.Left() + bracket.Right() > shortest)) {
        return;
      }
      const auto [near, far] = Inside(bracket, expected.apart);
      bracket.Take(far);
      bracket.Take(near);
    }
  }

 private:
  // Steps onwards from a width that costs less than the one behind it until the costs rise.
  Bracket Enclose(Width behind, Width least) {
    const bool narrower = least.of_depth < behind.of_depth;
    double step = narrower ? -kNearStep : kNearStep;
    for (int i = 0; i < kMostSteps; ++i) {
      const auto [next, after] = Try(least.of_depth * (1 + step), least.of_depth * (1 + 2 * step));
      if (!(next.cost < least.cost)) {
        return Between(behind, least, next);
      }
      if (!(after.cost < next.cost)) {
        return Between(least, next, after);
      }
      behind = next;
      least = after;
      step = std::max(2 * step, -kMostNarrower);
    }
    return Between(behind, least, {least.of_depth * (1 + step), kNever});
  }
  // Two widths where the least is expected: at that place and a bit farther out, or to both sides.
  std::array<Width, 2> Inside(const Bracket& bracket, double apart) {
    const double centre = bracket.least.of_depth;
    const double side = apart < 0 ? -bracket.Left() : bracket.Right();
    return std::abs(apart) < kNear * std::abs(side)
               ? Try(centre - kNear * bracket.Left(), centre + kNear * bracket.Right())
               : Try(centre + apart, centre + apart + kBeyond * (side - apart));
  }

  const PressProfile& profile_;
  Break end_;
  double rounding_;
  TwoZonePress best_;
};

}  // namespace

TwoZonePress FitTwoZones(const PressProfile& profile, double t, double near_s, double of_interest,
                         double rounding) {
  KinkSearch search(profile, t, rounding);
  double width = near_s > 0 && near_s < t ? 1 - near_s / t : 0;
  std::array<Width, 2> start = search.Try(width, width * kSlightlyWider);
  if (!search.best().found) {
    for (std::size_t i = 0; i < kWidths.size(); i += 2) {
      search.Try(kWidths[i], kWidths[i + 1]);
    }
    if (search.best().found) {
      width = 1 - search.best().s / t;
      start = search.Try(width, width * kSlightlyWider);
    }
  }
  if (search.best().found) {
    search.Refine(start[0], start[1], of_interest);
  }
  return search.best();
}

namespace {

// Some steps of break and kink from a start, each in turn.
TwoZonePress Improve(const PressProfile& profile, TwoZonePress best) {
  constexpr int kSteps = 4;
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

TwoZonePress GuessTwoZones(const PressProfile& profile, double smooth_t, ZonesStart start) {
  constexpr std::size_t kNarrowWidths = 3;
  // By how much of its width a zone ends beyond the smooth break.
  constexpr std::array<double, 2> kStiffEnds = {-0.15, 0};
  constexpr std::array<double, 2> kSoftEnds = {0.3, 0.8};
  const std::array<double, 2>& ends = start == ZonesStart::kClose ? kStiffEnds : kSoftEnds;
  std::span<const double> widths = kWidths;
  if (start == ZonesStart::kNarrow) {
    widths = widths.first(kNarrowWidths);
  } else if (start == ZonesStart::kBeyond) {
    widths = widths.subspan(kNarrowWidths);
  }
  TwoZonePress best;
  for (const double width : widths) {
    const Break first(profile, smooth_t * (1 + ends[0] * width));
    const Break second(profile, smooth_t * (1 + ends[1] * width));
    TryTwo(profile, {&first, &second}, {first.outer.t * (1 - width), second.outer.t * (1 - width)},
           best);
  }
  return Improve(profile, best);
}

}  // namespace trammel::tap
