#include "tap/contact/break_models.h"

#include <algorithm>

namespace trammel::tap {
namespace {

constexpr double kUnknowns = 5;       // quadratic press, including the break
constexpr double kZonesUnknowns = 2;  // of the press in two zones beyond these
// Penalties of the press in two zones, in variances of the noise.
constexpr double kZonesCurve = 1.5;
constexpr double kZonesFar = 10;
constexpr double kZonesFarOfBent = 3;  // where the smooth presses show that something bends
// Reduction of a kink's penalty, in variances of the noise, if the outer zone has at least half of
// the inner one's slope; none if it has less than the other share, or is stiffer.
constexpr double kStiff = 1.5;
constexpr double kStiffRatio = 0.5;
constexpr double kSoftRatio = 0.35;
// Largest shift of a neighbour's answer, in parts of the press's depth. Noise-free d^1.25 to d^1.5
// and cubic presses differ by 0.03 to 0.08; larger shifts come from a kink in the noise.
constexpr double kMaxShift = 0.3;
// Slope below which the cubic press starts flat, per the mean slope: it would rather pull.
constexpr double kFlatStart = 0.25;
// Gain of the cubic press over the quadratic one, in variances of the noise, that proves a bend. If
// it starts flat and beats the power law as much, it proves a toe.
constexpr double kBends = 6;

// Searches thoroughly, for a press that bends: zones of every width, sharp and rounded kinks, at
// breaks farther and farther beyond the smooth one. Returns the guess if none is better.
TwoZonePress LookBeyond(const PressProfile& profile, double last_t, TwoZonePress guess,
                        const ZonesPrice& price) {
  constexpr std::array<double, 5> kBeyond = {0.05, 0.1, 0.17, 0.26, 0.38};  // relative to depth
  constexpr std::array<double, 2> kTried = {0, 0.6};
  for (const double beyond : kBeyond) {
    const double t = price.smooth_t * (1 + beyond);
    for (std::size_t i = 0; i < kTried.size() && t < last_t; ++i) {
      const TwoZonePress press = FitTwoZones(profile, OuterZone(profile, t), 0, kTried[i]);
      guess = price.Cost(press) < price.Cost(guess) ? press : guess;
    }
  }
  return guess;
}

// Finds the best break of the press in two zones next to a start, if a quick search is promising or
// smooth presses show a toe. `least` is the minimum of the smooth presses.
void FindZones(const PressProfile& profile, Scan scan, ZonesStart start, double least,
               Candidates& found) {
  const double unit = least / found.freedom;
  TwoZonePress guess = GuessTwoZones(profile, found.price.smooth_t, start);
  if (start == ZonesStart::kBeyond && (found.bends || found.flat_start)) {
    guess = LookBeyond(profile, scan.back().t, guess, found.price);
  }
  if (!(found.price.Cost(guess) < least || (found.toe && guess.found))) {
    return;
  }
  // The best rounding at the guess is retained along the break.
  const auto fit = [&](double t, double near_s, std::size_t rounding) {
    return FitTwoZones(profile, OuterZone(profile, t), near_s, kRoundings[rounding]);
  };
  // Increases the rounding as long as that improves the fit.
  ZonesMode mode;
  double min_at_guess = kNever;
  mode.kinks.s.fill(guess.s);
  const OuterZone outer(profile, guess.t);
  for (std::size_t i = 0; i < kRoundings.size() && mode.kinks.best + 1 >= i; ++i) {
    const TwoZonePress press = FitTwoZones(profile, outer, guess.s, kRoundings[i]);
    const double of_press = found.price.Cost(press);
    if (press.found) {
      mode.kinks.s[i] = press.s;
    }
    if (of_press < min_at_guess) {
      min_at_guess = of_press;
      mode.kinks.best = i;
    }
  }
  const std::size_t followed = mode.kinks.best;
  TwoZonePress best;
  double min_so_far = kNever;
  const auto cost = [&](double t) {
    const TwoZonePress press = fit(t, guess.s, followed);
    const double of_press = found.price.Cost(press);
    if (of_press <= min_so_far) {
      best = press;
      min_so_far = of_press;
    }
    return of_press;
  };
  const std::size_t below = profile.Below(guess.t);
  const PressProfile::At near = profile.Evaluate(guess.t, below);
  const double scale = BreakScale(near, below, unit);
  const Minimum middle = {guess.t, min_at_guess};
  // Outwards until the cost rises; nothing is beyond the scan.
  std::array<Minimum, 2> sides;
  constexpr std::array<double, 2> kWays = {-1, 1};
  for (std::size_t side = 0; side < sides.size(); ++side) {
    const double most = side == 0 ? guess.t - scan.front().t : scan.back().t - guess.t;
    double step = scale;
    do {
      step = std::min(2 * step, most);
      const double t = guess.t + kWays[side] * step;
      sides[side] = {t, cost(t)};
    } while (sides[side].sum_squares <= middle.sum_squares && step < most);
  }
  mode.least = FindMinimum(sides[0], middle, sides[1], cost, [&](double lowest) {
    return 8 * kEnoughOfScale * BreakScale(near, below, lowest / found.freedom);
  });
  if (!found.toe && mode.least.sum_squares > least) {
    return;
  }
  // Starting at this kink, the interval's likelihood at its middle is no less than the search's.
  if (best.t != mode.least.t) {
    best = fit(mode.least.t, guess.s, followed);
  }
  mode.kinks.s[followed] = best.s;
  found.modes[static_cast<std::size_t>(start)] = mode;
  if (mode.least.sum_squares < found.model[kTwoZones].sum_squares) {
    found.model[kTwoZones] = mode.least;
    found.zones = followed == 0 ? best : fit(mode.least.t, guess.s, 0);
  }
}

}  // namespace

double ZonesPrice::Cost(const TwoZonePress& press) const {
  return press.found ? std::min(press.sum_squares, press.sum_squares_curved + curve) + Far(press.t)
                     : kNever;
}

double ZonesPrice::Cost(const PressProfile& profile, double t, const Kinks& near) const {
  const OuterZone outer(profile, t);
  double least = kNever;
  for (std::size_t i = 0; i < kRoundings.size(); ++i) {
    least = std::min(least, Cost(FitTwoZones(profile, outer, near.s[i], kRoundings[i])));
  }
  return least;
}

double ZonesPrice::Allowance(const TwoZonePress& press) const {
  const double ratio = press.outer_slope / press.inner_slope;
  return press.found && ratio < 1
             ? stiff * std::clamp((ratio - kSoftRatio) / (kStiffRatio - kSoftRatio), 0.0, 1.0)
             : 0;
}

double ZonesPrice::Margin(const PressProfile& profile, double t, const Kinks& near,
                          double allowed) const {
  const OuterZone outer(profile, t);
  double margin = -kNever;
  const auto cost = [&](std::size_t k) {
    const TwoZonePress press = FitTwoZones(profile, outer, near.s[k], kRoundings[k]);
    const double of_press = Cost(press);
    margin = std::max(margin, allowed + Allowance(press) - of_press);
    return of_press;
  };
  const double of_best = cost(near.best);
  // Tries less and more rounding, while each explains the samples better than the one before.
  for (const int way : {-1, 1}) {
    double last = of_best;
    for (std::size_t k = near.best + way; margin < 0 && k < kRoundings.size(); k += way) {
      const double next = cost(k);
      if (!(next < last)) {
        break;
      }
      last = next;
    }
  }
  return margin;
}

double Candidates::OuterRatio() const {
  constexpr double kMuch = 10;  // of twice the logarithm of the likelihoods' ratio
  // Part of the force in the outer zone. A kink farther down may be a drive that catches up, unless
  // it is too sharp for that.
  constexpr double kAtStart = 0.4;
  constexpr double kAtStartOfSoft = 0.8;
  const double smooth = std::min({Cost(kQuadratic), Cost(kCubic), Cost(kPower)});
  const double kinked = price.Cost(zones) / variance;
  // Only the samples determine the noise's variance, and their number is that of independent ones.
  const double independent = freedom * noise_variance / variance;
  if (!zones.found || !(independent * std::log(smooth / kinked) > kMuch)) {
    return 1;
  }
  const double outer = zones.outer_slope * (zones.t - zones.s);
  const double inner = zones.s * (zones.inner_slope + zones.s * zones.inner_curve);
  const double ratio = zones.outer_slope / zones.inner_slope;
  const double most = ratio < kSoftRatio ? kAtStartOfSoft : kAtStart;
  return outer < most * (outer + inner) ? ratio : 1;
}

bool Candidates::Near(double t) const {
  return std::abs(t - model[kQuadratic].t) <= kMaxShift * model[kQuadratic].t;
}

Candidates FindCandidates(const PressProfile& profile, Scan scan, double inflation) {
  Candidates found;
  for (const std::size_t m : {kLinear, kQuadratic, kCubic}) {
    found.model[m] = FindMinimum(profile, scan, m);
  }
  const Minimum& quadratic = found.model[kQuadratic];
  if (quadratic.sum_squares == kNever) {
    return found;
  }
  found.power = FitPowerPress(profile, quadratic.t);
  if (found.power.found) {
    found.model[kPower] = {found.power.t, found.power.sum_squares};
  }
  const double cubic_t = found.model[kCubic].t;
  const PressProfile::Coefficients c = profile.Fit(cubic_t, PressProfile::kOrders);
  const double mean_slope = c.c[0] + cubic_t * (c.c[1] + cubic_t * c.c[2]);
  found.flat_start = c.c[0] < kFlatStart * mean_slope;
  for (const std::size_t m : {kCubic, kPower}) {
    if (!found.Near(found.model[m].t)) {
      found.model[m] = {};
    }
  }
  found.freedom = std::max(1.0, profile.Totals()[0] - kUnknowns);
  const double freedom = found.freedom;
  const double smooth =
      std::min({quadratic.sum_squares, found.model[kCubic].sum_squares * freedom / (freedom - 1),
                found.model[kPower].sum_squares});
  const double unit = smooth / freedom;
  const double at_least = found.model[kCubic].sum_squares + kBends * unit;
  found.bends = at_least < quadratic.sum_squares;
  found.toe = found.bends && found.flat_start && at_least < found.model[kPower].sum_squares;
  const double far = found.toe ? 0 : found.bends ? kZonesFarOfBent : kZonesFar;
  found.price = {kZonesCurve * unit, far * unit, quadratic.t, kStiff * unit};
  for (const ZonesStart start : kZonesStarts) {
    FindZones(profile, scan, start, smooth, found);
  }
  found.least = smooth;
  if (freedom > 2 * kZonesUnknowns) {
    found.least =
        std::min(smooth, found.model[kTwoZones].sum_squares * freedom / (freedom - kZonesUnknowns));
  }
  // Residuals of noise-free samples are rounding only; the floor keeps quotients finite.
  const double floor = 1e-24 * profile.Totals()[5] / freedom;
  found.noise_variance = std::max(found.least / freedom, floor);
  found.variance = inflation * found.noise_variance;
  return found;
}

}  // namespace trammel::tap
