#include "tap/contact/break_interval.h"

#include <algorithm>
#include <cmath>

namespace trammel::tap {
namespace {

// Penalties, added to the sum of squares in units of the noise variance; relative to the quadratic
// press. Tuned on 1000 taps each of linear, stiffening, softening, d^1.25, d^1.5 and cubic presses
// at 1 to 8 gf and 80 to 2000 samples/s: intervals cover 95 to 97 % if the press is linear or
// quadratic and at least 90 % elsewhere. The results change little between half and twice these.
constexpr double kCubic1 = 0.5;    // one coefficient more
constexpr double kHertz = -1;      // same number; supported by contact physics
constexpr double kYielding = 0.5;  // a power below 1: something yields under the nozzle
// Penalty of a kink anywhere, of any size; less if the press bends and starts flat, as with a toe,
// and none if smooth presses show a toe.
constexpr double kZones = 6.1;
constexpr double kZonesOfFlat = 1;
// Costs of smooth neighbours beside the press in two zones, which resembles them while narrow or
// soft.
constexpr double kCubicBeside = 1;
constexpr double kPowerBeside = 0.5;
// Amount by which a neighbour may beat the quadratic press before the latter's interval shrinks.
constexpr double kCredit = 1.5;
// Misfit allowance, if another form explains the samples much better than the quadratic press. The
// true form is about as far from the other: this share of the gain beyond the noise's, up to a
// limit.
constexpr double kMisfit = 0.15;
constexpr double kExplainedByNoise = 5;
constexpr double kMaxExplained = 12;
// Limit of the variance factor of means by correlation, up to which noise counts as white.
constexpr double kWhite = 1.2;
// Slope ratio of an outer zone so much softer that both readings matter: where the nozzle lets go,
// and where the press visibly ends.
constexpr double kElbow = 0.6;

// Outward shift of the end of a soft zone that starts flat, as a parabola, from the end of its best
// straight line, in widths of the latter. Applies if the zone is much softer than the inner one;
// less otherwise: plastic that thins out.
constexpr double kFlatEnd = 0.8;
// Twice the interval's reach: a break that two zones explain worse by this many variances than
// allowed ends the search on its side. Of two sets of 31,000 virtual taps, 1 and 7 have a part of
// the interval beyond it, and one the contact.
constexpr double kBarrier = 8;

double ZonesPenalty(const Candidates& candidates) {
  if (candidates.toe) {
    return 0;
  }
  return candidates.bends && candidates.flat_start ? kZonesOfFlat : kZones;
}

}  // namespace

BreakInterval::BreakInterval(const PressProfile& profile, const Candidates& candidates,
                             double reach)
    : profile_(profile),
      candidates_(candidates),
      power_penalty_(candidates.power.p < 1 ? kYielding : kHertz),
      zones_penalty_(ZonesPenalty(candidates)) {
  const double quadratic = candidates.Cost(kQuadratic);
  const double cubic = candidates.Cost(kCubic);
  const double power = candidates.Cost(kPower);
  const double zones = candidates.Cost(kTwoZones);
  const double neighbours =
      std::min({cubic + kCubic1, power + power_penalty_, zones + zones_penalty_});
  // If the noise is not white, an apparent form may be noise.
  const bool white = candidates.variance <= kWhite * candidates.noise_variance;
  if (white) {
    const double explained = quadratic - std::min({cubic, power, zones}) - kExplainedByNoise;
    reach += kMisfit * std::clamp(explained, 0.0, kMaxExplained);
  }
  level_ = std::min(quadratic, neighbours) + reach;
  zones_ =
      std::min({quadratic, cubic + kCubicBeside, power + kPowerBeside, zones + zones_penalty_}) +
      reach;
  const double credited = candidates.flat_start || !white ? quadratic : neighbours + kCredit;
  quadratic_ = std::max(std::min(quadratic, credited) + reach, level_);
}

bool BreakInterval::Find(Scan scan) {
  Seed();
  const bool zones = candidates_.Cost(kTwoZones) + zones_penalty_ <= zones_;
  if (lo_ <= hi_ && !Search(scan, nullptr)) {
    return false;
  }
  for (const ZonesMode& mode : candidates_.modes) {
    if (Holds(mode) && !Search(scan, &mode)) {
      return false;
    }
  }
  AddPower();
  if (zones) {
    AddElbow();
  }
  return lo_ <= hi_;
}

// Adds the minima of polynomial presses that belong to the interval.
void BreakInterval::Seed() {
  if (candidates_.Cost(kQuadratic) <= quadratic_) {
    lo_ = hi_ = candidates_.model[kQuadratic].t;
  }
  if (candidates_.Cost(kCubic) + kCubic1 <= level_) {
    lo_ = std::min(lo_, candidates_.model[kCubic].t);
    hi_ = std::max(hi_, candidates_.model[kCubic].t);
  }
}

// Returns the margin, positive inside, by the polynomial press with the most.
double BreakInterval::Margin(const PressProfile::At& at) const {
  const double quadratic = quadratic_ * candidates_.variance - SumSquares(at, kQuadratic);
  const bool ask_cubic = candidates_.model[kCubic].sum_squares < kNever && candidates_.Near(at.t);
  const double cubic =
      ask_cubic ? (level_ - kCubic1) * candidates_.variance - SumSquares(at, kCubic) : -kNever;
  return std::max(quadratic, cubic);
}

double BreakInterval::ZonesMargin(const ZonesMode& mode, double t) const {
  // Rejects breaks so far out that the penalty alone is too high, unless the zones explained the
  // samples much better there than at their best.
  constexpr double kBetter = 3;
  const ZonesPrice& price = candidates_.price;
  const double allowed = (zones_ - zones_penalty_) * candidates_.variance;
  const double least = mode.least.sum_squares - price.Far(mode.least.t);
  const double room = allowed - price.Far(t) - least + kBetter * candidates_.variance;
  return room < 0 ? room : price.Margin(profile_, t, mode.kinks, allowed);
}

bool BreakInterval::Holds(const ZonesMode& mode) const {
  const double left = (zones_ - zones_penalty_) * candidates_.variance - mode.least.sum_squares;
  return left >= 0 || (left + candidates_.price.stiff >= 0 && ZonesMargin(mode, mode.least.t) >= 0);
}

// Searches from the ends of the scan inwards for the outermost valid points.
BreakInterval::Part BreakInterval::PolynomialPart(Scan scan) const {
  Part part = {0, scan.size()};
  while (part.first < scan.size() && scan[part.first].t < lo_ && !(Margin(scan[part.first]) >= 0)) {
    ++part.first;
  }
  while (part.last > 0 && scan[part.last - 1].t > hi_ && !(Margin(scan[part.last - 1]) >= 0)) {
    --part.last;
  }
  return part;
}

// Searches outwards from the present interval, as two zones cost more to fit.
BreakInterval::Part BreakInterval::ZonesPart(Scan scan, const ZonesMode& mode, double from,
                                             double to) const {
  const double least = -kBarrier * candidates_.variance;
  std::size_t at = 0;
  while (at < scan.size() && scan[at].t < from) {
    ++at;
  }
  Part part = {at, at};
  while (at > 0 && !(scan[at - 1].t < kZonesFrom * candidates_.price.smooth_t)) {
    const double margin = ZonesMargin(mode, scan[--at].t);
    part.first = margin >= 0 ? at : part.first;
    if (margin < least) {
      break;
    }
  }
  while (part.last < scan.size() && !(scan[part.last].t > to)) {
    ++part.last;
  }
  for (at = part.last; at < scan.size(); ++at) {
    const double margin = ZonesMargin(mode, scan[at].t);
    part.last = margin >= 0 ? at + 1 : part.last;
    if (margin < least) {
      break;
    }
  }
  return part;
}

// Searches from the scan's outermost accepted point, or from the minimum, to the next rejected one.
bool BreakInterval::Search(Scan scan, const ZonesMode* zones) {
  // Evaluated twice at the start of the search for a border.
  double last_t = kNever;
  double last_margin = 0;
  const auto margin = [&](double t) {
    if (t != last_t) {
      last_t = t;
      last_margin = zones != nullptr ? ZonesMargin(*zones, t) : Margin(profile_.Evaluate(t));
    }
    return last_margin;
  };
  double lo = zones != nullptr ? zones->least.t : lo_;
  double hi = zones != nullptr ? zones->least.t : hi_;
  const auto [first, last] = zones != nullptr
                                 ? ZonesPart(scan, *zones, std::min(lo, lo_), std::max(hi, hi_))
                                 : PolynomialPart(scan);
  if (first == 0 || last == scan.size()) {
    return false;
  }
  // Neither loop passes a minimum: if no point is valid, the neighbours of the minima remain.
  lo = std::min(lo, scan[std::min(first, scan.size() - 1)].t);
  hi = std::max(hi, scan[last - 1].t);
  const double scale = BreakScale(scan[first], profile_.Below(scan[first].t), candidates_.variance);
  const double below = scan[first - 1].t;
  const double above = scan[last].t;
  if (below < lo_ && (lo <= lo_ || margin(lo_) >= 0)) {
    lo_ = std::min(lo_, FindBorder(std::min(lo, lo_), below, scale, margin));
  }
  if (above > hi_ && (hi >= hi_ || margin(hi_) >= 0)) {
    hi_ = std::max(hi_, FindBorder(std::max(hi, hi_), above, scale, margin));
  }
  return true;
}

void BreakInterval::AddPower() {
  const double left = level_ - candidates_.Cost(kPower) - power_penalty_;
  if (left > 0) {
    const PowerPress& power = candidates_.power;
    const double half = power.standard_deviation * std::sqrt(candidates_.variance * left);
    lo_ = std::min(lo_, power.t - half);
    hi_ = std::max(hi_, power.t + half);
  }
}

void BreakInterval::AddElbow() {
  const TwoZonePress& zones = candidates_.zones;
  const double ratio = candidates_.OuterRatio();
  if (ratio < kElbow) {
    lo_ = std::min(lo_, zones.Elbow());
    hi_ = std::max(hi_, zones.t + kFlatEnd * (1 - ratio) * (zones.t - zones.s));
  }
}

}  // namespace trammel::tap
