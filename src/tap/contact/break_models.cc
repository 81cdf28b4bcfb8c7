#include "tap/contact/break_models.h"

#include <algorithm>
#include <cmath>

namespace trammel::tap {

namespace {

// Samples on either side of any break point that is looked at: the press has three unknowns.
constexpr std::size_t kLeastBelow = 5;
constexpr std::size_t kLeastAbove = 4;
constexpr double kUnknowns = 5;     // of the quadratic press, with the break
constexpr double kRounding = 1e-9;  // of the stretch: sums of squares tell no less

// Brent's state: x the best point, w the second best, v the one before.
struct Brent {
  Minimum x, w, v;
  double a = 0;  // the bracket
  double b = 0;
  double step = 0;  // the last one, and the one before
  double before = 0;
  bool by_parabola = false;  // the last one

  // Whether the parabola through the three has its least at the best point: no other is worth it.
  [[nodiscard]] bool AtVertex(double tolerance) const {
    constexpr double kNearVertex = 0.3;
    return by_parabola && std::abs(step) < kNearVertex * tolerance;
  }

  // By a parabola through the three where it is to be trusted, by the golden section otherwise.
  [[nodiscard]] double Next(double tolerance) {
    constexpr double kGolden = 0.381966;
    const double r = (x.t - w.t) * (x.sum_squares - v.sum_squares);
    const double q = (x.t - v.t) * (x.sum_squares - w.sum_squares);
    const double p = (x.t - v.t) * q - (x.t - w.t) * r;
    const double to_vertex = -p / (2 * (q - r));
    const bool trusted = std::isfinite(to_vertex) && std::abs(to_vertex) < 0.5 * std::abs(before) &&
                         x.t + to_vertex > a && x.t + to_vertex < b;
    const double room = x.t < 0.5 * (a + b) ? b - x.t : a - x.t;
    before = trusted ? step : room;
    step = trusted ? to_vertex : kGolden * room;
    by_parabola = trusted;
    const double least = std::copysign(tolerance, trusted ? step : room);
    return x.t + (std::abs(step) >= tolerance ? step : least);
  }
  void Take(const Minimum& u) {
    if (u.sum_squares <= x.sum_squares) {
      (u.t < x.t ? b : a) = x.t;
      v = w;
      w = x;
      x = u;
      return;
    }
    (u.t < x.t ? a : b) = u.t;
    if (u.sum_squares <= w.sum_squares) {
      v = w;
      w = u;
    } else if (u.sum_squares <= v.sum_squares) {
      v = u;
    }
  }
};

}  // namespace

double BreakScale(const PressProfile::At& at, std::size_t below, double variance) {
  const double slope = std::abs(at.start_slope[0]);
  const double n = static_cast<double>(std::max<std::size_t>(below, 1));
  return slope > 0 ? std::max(3 * std::sqrt(variance / n) / slope, kRounding) : 1;
}

Scan ScanSamples(const PressProfile& profile, Workspace& workspace) {
  constexpr std::size_t kMost = 32;
  const std::span<const double> y = profile.samples().y;
  if (y.size() < kLeastBelow + kLeastAbove + 1) {
    return {};
  }
  const std::size_t range = y.size() - kLeastBelow - kLeastAbove;
  const std::size_t step = (range + kMost - 1) / kMost;
  const Scan scan = workspace.Take<PressProfile::At>((range + step - 1) / step);
  for (std::size_t i = 0; i < scan.size(); ++i) {
    const std::size_t below = kLeastBelow + i * step;
    scan[i] = profile.Evaluate(y[below], below);
  }
  return scan;
}

std::size_t FindLeast(Scan scan, std::size_t model) {
  std::size_t best = 0;
  double least = kNever;
  for (std::size_t i = 0; i < scan.size(); ++i) {
    const double cost = SumSquares(scan[i], model);
    if (cost < least) {
      best = i;
      least = cost;
    }
  }
  return best;
}

Minimum FindMinimum(const PressProfile& profile, Scan scan, std::size_t model) {
  const std::size_t best = FindLeast(scan, model);
  const auto of = [model](const PressProfile::At& at) {
    return Minimum{at.t, SumSquares(at, model)};
  };
  const Minimum middle = of(scan[best]);
  if (middle.sum_squares == kNever || best == 0 || best + 1 == scan.size()) {
    return middle;
  }
  const double freedom = std::max(1.0, profile.Totals()[0] - kUnknowns);
  const std::size_t below = profile.Below(middle.t);
  return FindMinimum(
      of(scan[best - 1]), middle, of(scan[best + 1]),
      [&](double t) { return SumSquares(profile.Evaluate(t, profile.Below(t)), model); },
      [&](double least) {
        return kEnoughOfScale * BreakScale(scan[best], below, least / freedom);
      });
}

Minimum FindMinimum(const Minimum& left, const Minimum& middle, const Minimum& right, OfBreak of,
                    OfBreak tolerance_at) {
  Brent brent;
  brent.x = middle;
  brent.w = left;
  brent.v = right;
  brent.a = left.t;
  brent.b = right.t;
  if (brent.v.sum_squares < brent.w.sum_squares) {
    std::swap(brent.w, brent.v);
  }
  brent.step = brent.before = brent.b - brent.a;
  constexpr int kMostSteps = 60;
  for (int step = 0; step < kMostSteps; ++step) {
    const double tolerance = tolerance_at(brent.x.sum_squares);
    const double centre = 0.5 * (brent.a + brent.b);
    if (std::abs(brent.x.t - centre) <= 2 * tolerance - 0.5 * (brent.b - brent.a)) {
      break;
    }
    const double t = brent.Next(tolerance);
    // Brent's own end asks for a point on either side besides.
    constexpr int kLeastSteps = 2;
    if (step >= kLeastSteps && brent.AtVertex(tolerance)) {
      break;
    }
    brent.Take({t, of(t)});
  }
  return brent.x;
}

namespace {

constexpr double kZonesUnknowns = 2;  // of the press in two zones beyond these
// Prices of the press in two zones, in variances of the noise.
constexpr double kZonesCurve = 1.5;
constexpr double kZonesFar = 10;
// Slope of an outer zone over the inner one's, below which it counts as soft.
constexpr double kSoftRatio = 0.35;
// Of the press's depth, by which a neighbour's answer may differ. Noise-free d^1.25 to d^1.5 and
// cubic presses differ by 0.03 to 0.08; farther off lies what a kink in the noise pretends.
constexpr double kMostShift = 0.3;
// Of the press's mean slope, below which the cubic press starts flat: it would rather pull.
constexpr double kFlatStart = 0.25;
// By which the cubic press must explain the samples better than the quadratic one, in variances of
// the noise, to show that the press bends; where it starts flat and explains them so much better
// than the power law, too, it shows a toe.
constexpr double kBends = 6;

// Finds the best break of the press in two zones next to a start, where a quick look promises
// anything or smooth presses show a toe. `least` is that of the smooth presses.
void FindZones(const PressProfile& profile, Scan scan, ZonesStart start, double least,
               Candidates& found) {
  const double unit = least / found.freedom;
  const TwoZonePress guess = GuessTwoZones(profile, found.price.smooth_t, start);
  if (!(found.price.Cost(guess) < least || (found.toe && guess.found))) {
    return;
  }
  // The rounding that explains the samples best at the guess is followed along the break.
  const auto fit = [&](double t, double near_s, std::size_t rounding) {
    return FitTwoZones(profile, t, near_s, kNever, kRoundings[rounding]);
  };
  // More and more of it, as long as that explains them better.
  ZonesMode mode;
  double least_at_guess = kNever;
  const double far = found.price.Far(guess.t);
  mode.kinks.s.fill(guess.s);
  const Breaks end(profile, guess.t);
  for (std::size_t i = 0; i < kRoundings.size() && mode.kinks.best + 1 >= i; ++i) {
    const TwoZonePress press =
        FitTwoZones(profile, end, guess.s, least_at_guess - far, kRoundings[i]);
    const double of_press = found.price.Cost(press);
    if (press.found) {
      mode.kinks.s[i] = press.s;
    }
    if (of_press < least_at_guess) {
      least_at_guess = of_press;
      mode.kinks.best = i;
    }
  }
  const std::size_t followed = mode.kinks.best;
  TwoZonePress best;
  double least_so_far = kNever;
  const auto cost = [&](double t) {
    const TwoZonePress press = fit(t, guess.s, followed);
    const double of_press = found.price.Cost(press);
    if (of_press <= least_so_far) {
      best = press;
      least_so_far = of_press;
    }
    return of_press;
  };
  const std::size_t below = profile.Below(guess.t);
  const PressProfile::At near = profile.Evaluate(guess.t, below);
  const double scale = BreakScale(near, below, unit);
  const Minimum middle = {guess.t, least_at_guess};
  // Outwards until it costs more; beyond the scan there is nothing.
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
  // With this kink as a start, the interval finds no less of a likelihood at its middle than the
  // search did.
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
  const Breaks end(profile, t);
  double least = kNever;
  for (std::size_t i = 0; i < kRoundings.size(); ++i) {
    least = std::min(least, Cost(FitTwoZones(profile, end, near.s[i], kNever, kRoundings[i])));
  }
  return least;
}

double ZonesPrice::Margin(const PressProfile& profile, double t, const Kinks& near,
                          double allowed) const {
  const Breaks end(profile, t);
  double margin = -kNever;
  const auto cost = [&](std::size_t k) {
    const TwoZonePress press =
        FitTwoZones(profile, end, near.s[k], allowed - Far(t), kRoundings[k]);
    const double of_press = Cost(press);
    margin = std::max(margin, allowed - of_press);
    return of_press;
  };
  const double of_best = cost(near.best);
  // To less and to more rounding, as far as each explains the samples better than the one before.
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
  // Of the force in the outer zone: a kink deeper down may be that of a drive that catches up, but
  // for one that is too sharp for it.
  constexpr double kAtStart = 0.4;
  constexpr double kAtStartOfSoft = 0.8;
  const double smooth = std::min({Cost(kQuadratic), Cost(kCubic), Cost(kPower)});
  const double kinked = price.Cost(zones) / variance;
  // The noise's variance is known from the samples only, and their number is that of independent
  // ones.
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
  return std::abs(t - model[kQuadratic].t) <= kMostShift * model[kQuadratic].t;
}

Candidates FindCandidates(const PressProfile& profile, Scan scan, double inflation,
                          bool neighbours) {
  Candidates found;
  for (const std::size_t m : {kLinear, kQuadratic, kCubic}) {
    found.model[m] = FindMinimum(profile, scan, m);
  }
  const Minimum& quadratic = found.model[kQuadratic];
  if (quadratic.sum_squares == kNever) {
    return found;
  }
  if (neighbours) {
    found.power = FitPowerPress(profile, quadratic.t);
  }
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
  found.toe = found.flat_start && at_least < quadratic.sum_squares &&
              at_least < found.model[kPower].sum_squares;
  const double far = found.toe ? 0 : kZonesFar;
  found.price = {kZonesCurve * unit, far * unit, quadratic.t};
  if (neighbours) {
    for (const ZonesStart start : kZonesStarts) {
      FindZones(profile, scan, start, smooth, found);
    }
  }
  found.least = smooth;
  if (freedom > 2 * kZonesUnknowns) {
    found.least =
        std::min(smooth, found.model[kTwoZones].sum_squares * freedom / (freedom - kZonesUnknowns));
  }
  // Noise-free samples leave rounding only; the floor keeps quotients finite.
  const double floor = 1e-24 * profile.Totals()[5] / freedom;
  found.noise_variance = std::max(found.least / freedom, floor);
  found.variance = inflation * found.noise_variance;
  return found;
}

}  // namespace trammel::tap
