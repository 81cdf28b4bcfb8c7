#include "tap/contact/two_zone_press.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <span>

#include "tap/contact/break_search.h"

namespace trammel::tap {
namespace {

constexpr double kLeastRatio = 0.05;  // of the outer slope to the inner one
// Widths of the outer zone that are tried, of the depth; steps around the best, of its width, and
// by what they shrink where they lead nowhere.
constexpr std::array<double, 8> kWidths = {0.025, 0.05, 0.09, 0.15, 0.24, 0.36, 0.55, 0.8};
constexpr double kStep = 0.25;
constexpr double kShrink = 0.4;
constexpr int kMostSteps = 14;
constexpr std::size_t kMostTrials = 36;  // of one search: two starts, four widths, both ways on
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

// Presses that were tried. Which of them is better nobody can predict: all are written down, and
// the place of the best is kept without branches.
class Trials {
 public:
  // Sums of squares of two; kNever where a zone is too short or does not press.
  [[gnu::noinline]] Pair Try(const PressProfile& profile, const Breaks& breaks, Pair s,
                             double rounding = 0) {
    const Pair round = rounding * (breaks.outer.t - s);
    const TwoZones at = rounding > 0 ? EvaluateRounded(profile, breaks.outer, s + round, s - round)
                                     : EvaluateTwoZones(profile, breaks.outer, s);
    const Pair inner = at.outer_slope + at.added_slope;
    const auto allowed = (s > breaks.above) & (s <= breaks.up_to) & (inner > 0) &
                         (at.outer_slope >= kLeastRatio * inner);
    const Pair never = {kNever, kNever};
    const Pair least = at.sum_squares_curved > 0 ? at.sum_squares_curved : Pair{0, 0};
    const Pair costs = allowed ? least : never;
    trials_[count_] = {breaks.outer.t, s, at, costs};
    for (std::size_t i = 0; i < 2; ++i) {
      best_ = costs[i] < least_ ? 2 * count_ + i : best_;
      least_ = costs[i] < least_ ? costs[i] : least_;
    }
    ++count_;
    return costs;
  }
  [[nodiscard]] bool Found() const { return least_ < kNever; }
  [[nodiscard]] double Least() const { return least_; }
  [[nodiscard]] double BestKink() const { return trials_[best_ / 2].s[best_ % 2]; }
  [[nodiscard]] TwoZonePress Best() const {
    if (!Found()) {
      return {};
    }
    const Trial& trial = trials_[best_ / 2];
    const std::size_t i = best_ % 2;
    const TwoZones& at = trial.at;
    return {trial.t[i],        trial.s[i],
            at.outer_slope[i], at.outer_slope[i] + at.added_slope[i],
            at.added_curve[i], std::max(0.0, at.sum_squares[i]),
            trial.costs[i],    true};
  }

 private:
  struct Trial {
    Pair t, s;
    TwoZones at;
    Pair costs;
  };
  // Without values to begin with.
  std::array<Trial, kMostTrials> trials_;
  std::size_t count_ = 0;
  std::size_t best_ = 0;
  double least_ = kNever;
};

// A width of the outer zone, of the depth, and what it costs. Worked on as a pair: which of two
// costs less nobody can predict, and a processor that guesses wrongly loses more than the rest
// takes.
using Width = Pair;
using Mask = decltype(Pair{} < Pair{});
constexpr std::size_t kOfDepth = 0;
constexpr std::size_t kCost = 1;

Mask Both(const Mask& mask, std::size_t i) { return Mask{mask[i], mask[i]}; }

// A least between its neighbours, which may be out of the question.
struct Bracket {
  Width below, least, above;

  // To the neighbours' widths.
  [[nodiscard]] Pair Apart() const {
    return {least[kOfDepth] - below[kOfDepth], above[kOfDepth] - least[kOfDepth]};
  }
  void Take(const Width& width) {
    const Mask inside = Both((width > below) & (width < above), kOfDepth);
    const Mask narrower = Both(width < least, kOfDepth);
    const Mask lower = Both(width < least, kCost);
    const Width neighbour = lower ? least : width;
    below = inside & (lower ^ narrower) ? neighbour : below;
    above = inside & ~(lower ^ narrower) ? neighbour : above;
    least = inside & lower ? width : least;
  }
};

// Where next to a least a lower one is expected, and by how much lower: of the parabola through the
// three; where a neighbour is out of the question, of the line from the other.
struct Expected {
  double apart = 0;
  double gain = 0;
};

Expected Expect(const Bracket& bracket) {
  const auto apart = bracket.Apart();
  const double left = apart[0];
  const double right = apart[1];
  const double to_below = bracket.below[kCost] - bracket.least[kCost];
  const double to_above = bracket.above[kCost] - bracket.least[kCost];
  if (to_below == kNever || to_above == kNever) [[unlikely]] {
    const bool leftwards = to_below == kNever;
    return {leftwards ? -kTowardsEdge * left : kTowardsEdge * right,
            leftwards ? to_above / right * left : to_below / left * right};
  }
  const double below = to_below * right;
  const double above = to_above * left;
  const double sum = below + above;
  const double to_least = sum > 0 ? 0.5 * (below * right - above * left) / sum : 0;
  return {to_least, sum / (left * right * (left + right)) * to_least * to_least};
}

// The search for the best kink below a break, along the width of the outer zone.
class KinkSearch {
 public:
  KinkSearch(const PressProfile& profile, const Breaks& end, double rounding)
      : profile_(profile), end_(end), rounding_(rounding) {}

  [[nodiscard]] const Trials& trials() const { return trials_; }
  // What two widths cost.
  Pair Try(Pair of_depth) {
    return trials_.Try(profile_, end_, end_.outer.t * (1 - of_depth), rounding_);
  }
  // Goes down from the better of two widths, while less than that is to be expected.
  void Refine(const Pair& of_depth, const Pair& costs, double of_interest) {
    const auto samples = static_cast<double>(profile_.samples().y.size());
    const Width one = {of_depth[0], costs[0]};
    const Width other = {of_depth[1], costs[1]};
    const Mask first = Both(one < other, kCost);
    Bracket bracket = Enclose(first ? other : one, first ? one : other);
    for (int i = 0; i < kMostSteps; ++i) {
      const Expected expected = Expect(bracket);
      const double least = bracket.least[kCost];
      if (least - kSurprise * expected.gain > of_interest ||
          (i >= kLeastRounds && expected.gain < kEnough * least / samples) ||
          !(bracket.above[kOfDepth] - bracket.below[kOfDepth] >
            kLeastStep * bracket.least[kOfDepth])) {
        return;
      }
      const Pair inside = Inside(bracket, expected.apart);
      const Pair found = Try(inside);
      bracket.Take({inside[1], found[1]});
      bracket.Take({inside[0], found[0]});
    }
  }

 private:
  // Steps onwards from a width that costs less than the one behind it until the costs rise.
  Bracket Enclose(Width behind, Width least) {
    const Mask narrower = Both(least < behind, kOfDepth);
    double step = narrower[0] != 0 ? -kNearStep : kNearStep;
    Width next = least;
    for (int i = 0; i < kMostSteps; ++i) {
      const Pair of_depth = least[kOfDepth] * (1 + Pair{step, 2 * step});
      const Pair costs = Try(of_depth);
      next = {of_depth[0], costs[0]};
      const Width after = {of_depth[1], costs[1]};
      if (!(costs[0] < least[kCost] && costs[1] < costs[0])) {
        const Mask lower = Both(next < least, kCost);
        behind = lower ? least : behind;
        least = lower ? next : least;
        next = lower ? after : next;
        break;
      }
      behind = next;
      least = after;
      step = std::max(2 * step, -kMostNarrower);
      next = {least[kOfDepth] * (1 + step), kNever};
    }
    return {narrower ? next : behind, least, narrower ? behind : next};
  }
  // Two widths where the least is expected: at that place and a bit farther out, or to both sides.
  static Pair Inside(const Bracket& bracket, double apart) {
    const Pair sides = bracket.Apart() * Pair{-1, 1};
    const double side = apart < 0 ? sides[0] : sides[1];
    const Pair onwards = {apart, apart + kBeyond * (side - apart)};
    const Pair near = {std::abs(apart), std::abs(apart)};
    const Pair far = Pair{} + kNear * std::abs(side);
    return bracket.least[kOfDepth] + (near < far ? kNear * sides : onwards);
  }

  const PressProfile& profile_;
  const Breaks& end_;
  double rounding_;
  Trials trials_;
};

}  // namespace

TwoZonePress FitTwoZones(const PressProfile& profile, const Breaks& end, double near_s,
                         double of_interest, double rounding) {
  KinkSearch search(profile, end, rounding);
  const double t = end.outer.t[0];
  double width = near_s > 0 && near_s < t ? 1 - near_s / t : 0;
  constexpr Pair kStart = {1, kSlightlyWider};
  Pair costs = search.Try(width * kStart);
  if (!search.trials().Found()) {
    for (std::size_t i = 0; i < kWidths.size(); i += 2) {
      search.Try(Pair{kWidths[i], kWidths[i + 1]});
    }
    if (search.trials().Found()) {
      width = 1 - search.trials().BestKink() / t;
      costs = search.Try(width * kStart);
    }
  }
  if (search.trials().Found()) {
    search.Refine(width * kStart, costs, of_interest);
  }
  return search.trials().Best();
}

namespace {

// Some steps of break and kink from the best of some trials, each in turn.
TwoZonePress Improve(const PressProfile& profile, Trials& trials) {
  constexpr int kSteps = 4;
  double step = kStep;
  Breaks same(profile, trials.Best().t);
  for (int i = 0; trials.Found() && i < kSteps; ++i) {
    const TwoZonePress centre = trials.Best();
    if (centre.t != same.outer.t[0]) {
      same = Breaks(profile, centre.t);
    }
    const double apart = step * (centre.t - centre.s);
    const Pair kink = {centre.s, centre.s};
    trials.Try(profile, Breaks(profile, Pair{centre.t - apart, centre.t + apart}), kink);
    trials.Try(profile, same, kink + Pair{apart, -apart});
    step *= trials.Least() < centre.sum_squares_curved ? 1 : kShrink;
  }
  return trials.Best();
}

}  // namespace

TwoZonePress GuessTwoZones(const PressProfile& profile, double smooth_t, ZonesStart start) {
  constexpr std::size_t kNarrowWidths = 3;
  // By how much of its width a zone ends beyond the smooth break.
  constexpr Pair kStiffEnds = {-0.15, 0};
  constexpr Pair kSoftEnds = {0.3, 0.8};
  const Pair ends = start == ZonesStart::kClose ? kStiffEnds : kSoftEnds;
  std::span<const double> widths = kWidths;
  if (start == ZonesStart::kNarrow) {
    widths = widths.first(kNarrowWidths);
  } else if (start == ZonesStart::kBeyond) {
    widths = widths.subspan(kNarrowWidths);
  }
  Trials trials;
  for (const double width : widths) {
    const Breaks breaks(profile, smooth_t * (1 + ends * width));
    trials.Try(profile, breaks, breaks.outer.t * (1 - width));
  }
  return Improve(profile, trials);
}

}  // namespace trammel::tap
