#include "tap/break_models.h"

#include <algorithm>

namespace trammel::tap {
namespace {

constexpr double kUnknowns = 5;       // of the quadratic press, with the break
constexpr double kZonesUnknowns = 2;  // of the press in two zones beyond these
// Prices of the press in two zones, in variances of the noise.
constexpr double kZonesCurve = 1.5;
constexpr double kZonesFar = 10;
// Of the press's depth, by which a neighbour's answer may differ. Noise-free d^1.25 to d^1.5 and
// cubic presses differ by 0.03 to 0.08; farther off lies what a kink in the noise pretends.
constexpr double kMostShift = 0.3;
// Of the press's mean slope, below which the cubic press starts flat: it would rather pull.
constexpr double kFlatStart = 0.25;

// The best break of the press in two zones, over the whole scan.
void FindZones(const PressProfile& profile, Scan scan, Workspace& workspace, Candidates& found) {
  const Workspace::Scope scope(workspace);
  const std::span<Minimum> tried = workspace.Take<Minimum>(scan.size());
  const auto cost = [&](double t) { return found.price.Cost(FitTwoZones(profile, t)); };
  std::size_t count = 0;
  std::size_t best = 0;
  for (const PressProfile::At& at : scan) {
    if (!tried.empty() && at.t >= kZonesFrom * found.price.smooth_t) {
      tried[count] = {at.t, cost(at.t)};
      best = tried[count].sum_squares < tried[best].sum_squares ? count : best;
      ++count;
    }
  }
  if (best == 0 || best + 1 >= count || tried[best].sum_squares == kNever) {
    return;
  }
  const PressProfile::At near = profile.Evaluate(tried[best].t);
  const std::size_t below = profile.Below(near.t);
  found.model[kTwoZones] =
      FindMinimum(tried[best - 1], tried[best], tried[best + 1], cost, [&](double least) {
        return kEnoughOfScale * BreakScale(near, below, least / found.freedom);
      });
  found.zones = FitTwoZones(profile, found.model[kTwoZones].t);
}

}  // namespace

double ZonesPrice::Cost(const TwoZonePress& press) const {
  return press.found ? std::min(press.sum_squares, press.sum_squares_curved + curve) +
                           far * std::max(0.0, press.t / smooth_t - 1)
                     : kNever;
}

double Candidates::OuterRatio() const {
  constexpr double kMuch = 10;        // variances of the noise
  constexpr double kMostShare = 0.4;  // of the force: a kink deeper down is not the start's
  const double smooth = std::min({Cost(kQuadratic), Cost(kCubic), Cost(kPower)});
  if (!zones.found || !(smooth - Cost(kTwoZones) > kMuch)) {
    return 1;
  }
  const double outer = zones.outer_slope * (zones.t - zones.s);
  const double inner = zones.s * (zones.inner_slope + zones.s * zones.inner_curve);
  return outer < kMostShare * (outer + inner) ? zones.outer_slope / zones.inner_slope : 1;
}

bool Candidates::Near(double t) const {
  return std::abs(t - model[kQuadratic].t) <= kMostShift * model[kQuadratic].t;
}

Candidates FindCandidates(const PressProfile& profile, Scan scan, double inflation,
                          Workspace& workspace) {
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
  found.price = {kZonesCurve * unit, kZonesFar * unit, quadratic.t};
  FindZones(profile, scan, workspace, found);
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
