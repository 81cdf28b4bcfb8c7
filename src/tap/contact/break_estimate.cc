#include "tap/contact/break_estimate.h"

#include <algorithm>
#include <array>
#include <cmath>

#include "tap/contact/break_models.h"

namespace trammel::tap {

namespace {

// Added to the sum of squares in units of the noise variance; relative to the quadratic press.
// Tuned on 1000 taps each of linear, stiffening, softening, d^1.25, d^1.5 and cubic presses at 1 to
// 8 gf and 80 to 2000 samples/s so that intervals cover 95 to 97 % where the press is linear or
// quadratic and at least 90 % elsewhere; the results change little between half and twice these.
constexpr double kCubic1 = 0.5;    // one coefficient more
constexpr double kHertz = -1;      // as many, and physics is on its side
constexpr double kYielding = 0.5;  // a power below 1: something yields under the nozzle
// A kink anywhere, of any size; nothing where smooth presses show a toe.
constexpr double kZones = 6.1;
// What smooth neighbours cost beside the press in two zones, which looks like them while it is
// narrow or soft.
constexpr double kCubicBeside = 1;
constexpr double kPowerBeside = 0.5;
// By which a neighbour may beat the quadratic press before the interval of the latter shrinks.
constexpr double kCredit = 1.5;
// Where another form explains the samples much better than the quadratic press, the true one
// differs from both, and remains so far from it: this share of the gain, beyond what noise makes of
// it and up to a limit.
constexpr double kMisfit = 0.15;
constexpr double kExplainedByNoise = 5;
constexpr double kMostExplained = 12;
// By which correlation may raise the variance of means before the noise is white no more.
constexpr double kWhite = 1.2;
// Where the outer zone is so much softer, both readings are of interest: where the nozzle lets go,
// and where an eye sees the press itself end.
constexpr double kElbow = 0.6;

// A soft zone that starts flat, as a parabola, ends farther out than the straight line that goes
// best with it, by so much of the latter's width where it is much softer than the inner zone, and
// less where it is not: plastic that thins out.
constexpr double kFlatEnd = 0.8;
// Twice the interval's reach: a break that two zones explain so many variances worse than is
// allowed ends the search on its side. Of two sets of 31,000 virtual taps 1 and 7 have a part of
// the interval behind it, and of one the contact.
constexpr double kBarrier = 8;

}  // namespace

BreakInterval::BreakInterval(const PressProfile& profile, const Candidates& candidates,
                             double reach)
    : profile_(profile),
      candidates_(candidates),
      power_penalty_(candidates.power.p < 1 ? kYielding : kHertz),
      zones_penalty_(candidates.toe ? 0 : kZones) {
  const double quadratic = candidates.Cost(kQuadratic);
  const double cubic = candidates.Cost(kCubic);
  const double power = candidates.Cost(kPower);
  const double zones = candidates.Cost(kTwoZones);
  const double neighbours =
      std::min({cubic + kCubic1, power + power_penalty_, zones + zones_penalty_});
  // Where the noise is not white, what looks like a form may be the noise's.
  const bool white = candidates.variance <= kWhite * candidates.noise_variance;
  if (white) {
    const double explained = quadratic - std::min({cubic, power, zones}) - kExplainedByNoise;
    reach += kMisfit * std::clamp(explained, 0.0, kMostExplained);
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

// The minima of polynomial presses that belong to the interval.
void BreakInterval::Seed() {
  if (candidates_.Cost(kQuadratic) <= quadratic_) {
    lo_ = hi_ = candidates_.model[kQuadratic].t;
  }
  if (candidates_.Cost(kCubic) + kCubic1 <= level_) {
    lo_ = std::min(lo_, candidates_.model[kCubic].t);
    hi_ = std::max(hi_, candidates_.model[kCubic].t);
  }
}

// Positive inside, by the polynomial press that gives most room.
double BreakInterval::Margin(const PressProfile::At& at) const {
  const double quadratic = quadratic_ * candidates_.variance - SumSquares(at, kQuadratic);
  const bool ask_cubic = candidates_.model[kCubic].sum_squares < kNever && candidates_.Near(at.t);
  const double cubic =
      ask_cubic ? (level_ - kCubic1) * candidates_.variance - SumSquares(at, kCubic) : -kNever;
  return std::max(quadratic, cubic);
}

double BreakInterval::ZonesMargin(const ZonesMode& mode, double t) const {
  // So far out that the price alone is too high, unless they explained the samples much better
  // there than where they do best.
  constexpr double kBetter = 3;
  const ZonesPrice& price = candidates_.price;
  const double allowed = (zones_ - zones_penalty_) * candidates_.variance;
  const double least = mode.least.sum_squares - price.Far(mode.least.t);
  const double room = allowed - price.Far(t) - least + kBetter * candidates_.variance;
  return room < 0 ? room : price.Margin(profile_, t, mode.kinks, allowed);
}

bool BreakInterval::Holds(const ZonesMode& mode) const {
  return mode.least.sum_squares <= (zones_ - zones_penalty_) * candidates_.variance;
}

// Looks from the ends of the scan inwards for the outermost points that hold.
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

// Looks outwards from what the interval holds already, for two zones cost more to fit.
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

// From the outermost point of the scan that holds, or from the minimum, to the next that does not.
bool BreakInterval::Search(Scan scan, const ZonesMode* zones) {
  // Asked twice of a place where the search for a border sets out.
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
  // Neither loop passes a minimum: where no point holds, the neighbours of the minima are left.
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

namespace {

// What a model's answer costs as the point, in variances of the noise: answers that scatter more
// must explain the samples much better.
constexpr double kLinearPoint = -3;  // one coefficient less: Akaike's 2, and the common press
constexpr double kCubicPoint = 8;
constexpr double kPowerPoint = 8;
constexpr double kZonesPoint = 20;
constexpr double kZonesShape = 16;  // as the form that is taken out of the residuals

// 97.5 % quantile of Student's t (Cornish-Fisher; Abramowitz & Stegun 26.7.5): 0.2 % off at 6.
double Quantile(double freedom) {
  constexpr double z = 1.959964;
  constexpr double z3 = z * z * z;
  constexpr double z5 = z3 * z * z;
  return z + (z3 + z) / (4 * freedom) + (5 * z5 + 16 * z3 + 3 * z) / (96 * freedom * freedom);
}

double Average(const Candidates& candidates, std::size_t& order) {
  constexpr std::array<double, kModels> kPenalty = {kLinearPoint, 0, kCubicPoint, kPowerPoint,
                                                    kZonesPoint};
  std::array<double, kModels> cost{};
  for (std::size_t m = 0; m < kModels; ++m) {
    cost[m] = candidates.Cost(m) + kPenalty[m];
  }
  if (candidates.flat_start && cost[kCubic] < cost[kQuadratic]) {
    cost[kQuadratic] = cost[kCubic];
  }
  const double least = *std::min_element(cost.begin(), cost.end());
  double sum = 0;
  double sum_t = 0;
  for (std::size_t m = 0; m < kModels; ++m) {
    const double weight = std::exp(-0.5 * (cost[m] - least));
    sum += weight;
    sum_t += weight > 0 ? weight * candidates.model[m].t : 0;
  }
  order = std::min(cost[kCubic], cost[kPower]) < cost[kQuadratic] ? 3 : 2;
  return sum_t / sum;
}

// The cubic press at the answer, the most flexible of the smooth ones, unless another one explains
// the samples better: its residuals hold the most noise and the least of the form.
PressShape BestShape(const PressProfile& profile, const Candidates& candidates, double t) {
  const double cubic = SumSquares(profile.Evaluate(t), kCubic);
  const double power = candidates.model[kPower].sum_squares;
  const double zones = candidates.model[kTwoZones].sum_squares;
  PressShape shape;
  const TwoZonePress& press = candidates.zones;
  if (zones + kZonesShape * candidates.variance < std::min(cubic, power)) {
    shape.t = press.t;
    shape.c[0] = press.outer_slope;
    shape.kink_t = press.s;
    shape.added_slope = press.inner_slope - press.outer_slope;
    shape.added_curve = press.inner_curve;
  } else if (power < cubic) {
    shape.t = candidates.power.t;
    shape.power_c = candidates.power.c;
    shape.power = candidates.power.p;
  } else {
    shape.t = t;
    shape.c = profile.Fit(t, PressProfile::kOrders).c;
  }
  return shape;
}

}  // namespace

double PressShape::Slope(double y) const {
  constexpr double kNear = 0.02;
  const double d = t - y;
  if (!(d > 0)) {
    return 0;
  }
  const double e = std::max(0.0, kink_t - y);
  const double by_power =
      power_c != 0 ? power_c * power * std::pow(std::max(d, kNear * t), power - 1) : 0;
  const double by_kink = e > 0 ? added_slope + 2 * e * added_curve : 0;
  return -(c[0] + d * (2 * c[1] + 3 * d * c[2]) + by_power + by_kink);
}

bool PressShape::GrowsTo(double depth) const {
  const auto slope = [&](double d) { return c[0] + d * (2 * c[1] + 3 * d * c[2]); };
  const double vertex = std::clamp(c[2] != 0 ? -c[1] / (3 * c[2]) : 0, 0.0, depth);
  const double below_kink = std::max(0.0, kink_t - t + depth);
  const double added = std::min({0.0, added_slope, added_slope + 2 * below_kink * added_curve});
  return power_c >= 0 && std::min({slope(0), slope(vertex), slope(depth)}) + added >= 0;
}

double PressShape::OuterSlope() const {
  constexpr double kPart = 0.25;
  return At((1 - kPart) * t) / (kPart * t);
}

BreakEstimate EstimateBreak(const PressProfile& profile, const BreakTask& task,
                            Workspace& workspace) {
  BreakEstimate result;
  if (!profile.Ready()) {
    return result;
  }
  const Workspace::Scope scope(workspace);
  const Scan scan = ScanSamples(profile, workspace);
  if (scan.empty()) {
    return result;
  }
  result.candidates = task.known != nullptr
                          ? *task.known
                          : FindCandidates(profile, scan, task.inflation, task.neighbours);
  Candidates& candidates = result.candidates;
  candidates.variance = task.inflation * candidates.noise_variance;
  if (candidates.variance == 0) {
    result.outcome = BreakEstimate::Outcome::kNoPress;
    return result;
  }
  result.noise = std::sqrt(candidates.noise_variance);
  result.quadratic_t = candidates.model[kQuadratic].t;
  result.cubic_t = candidates.model[kCubic].t;
  result.power_t = candidates.model[kPower].t;
  result.outer_ratio = candidates.OuterRatio();
  result.t = Average(candidates, result.order);
  if (task.interval) {
    const double quantile = Quantile(candidates.freedom);
    BreakInterval interval(profile, candidates, quantile * quantile);
    if (!interval.Find(scan)) {
      result.outcome = BreakEstimate::Outcome::kAtEdge;
      return result;
    }
    result.lo = interval.lo();
    result.hi = interval.hi();
    result.t = std::clamp(result.t, result.lo, result.hi);
    result.standard_uncertainty = 0.5 * (result.hi - result.lo) / quantile;
  }
  result.below = profile.Below(result.t);
  result.shape = BestShape(profile, candidates, result.t);
  result.outcome = BreakEstimate::Outcome::kFound;
  return result;
}

}  // namespace trammel::tap
