#include "tap/break_estimate.h"

#include <algorithm>
#include <array>
#include <cmath>

#include "tap/break_search.h"

namespace trammel::tap {
namespace {

constexpr double kUnknowns = 5;  // of the quadratic press, with the break

enum Model : std::size_t { kLinear, kQuadratic, kCubic, kPower, kModels };

// Added to the sum of squares in units of the noise variance; relative to the quadratic press.
// Tuned on 1000 taps each of linear, stiffening, softening, d^1.25, d^1.5 and cubic presses at 1 to
// 8 gf and 80 to 2000 samples/s so that intervals cover 95 to 97 % where the press is linear or
// quadratic and at least 90 % elsewhere; the results change little between half and twice these.
constexpr double kCubicInterval = 0.5;  // one coefficient more
constexpr double kPowerInterval = -1;   // as many, and physics is on its side (Hertz)
constexpr double kLinearPoint = -3;     // one coefficient less: Akaike's 2, and the common press
constexpr double kCubicPoint = 8;
constexpr double kPowerPoint = 8;
// By which a neighbour may beat the quadratic press before the interval of the latter shrinks.
constexpr double kCredit = 1.5;
// Of the press's depth, by which a neighbour's answer may differ. Noise-free d^1.25 to d^1.5 and
// cubic presses differ by 0.03 to 0.08; farther off lies what a kink in the noise pretends.
constexpr double kMostShift = 0.3;
// Of the press's mean slope, below which the cubic press starts flat: it would rather pull.
constexpr double kFlatStart = 0.25;

// 97.5 % quantile of Student's t (Cornish-Fisher; Abramowitz & Stegun 26.7.5): 0.2 % off at 6.
double Quantile(double freedom) {
  constexpr double z = 1.959964;
  constexpr double z3 = z * z * z;
  constexpr double z5 = z3 * z * z;
  return z + (z3 + z) / (4 * freedom) + (5 * z5 + 16 * z3 + 3 * z) / (96 * freedom * freedom);
}

struct Candidates {
  std::array<Minimum, kModels> model;
  PowerPress power;
  double variance = 0;  // of the noise, as it acts on means
  double reach = 0;     // of the interval, in units of the variance
  // The samples ask for a start that no cubic press has: a toe, a thread, plastic. It is not known
  // whether toe or press ends the contact, and the quadratic press's answer stays in question.
  bool flat_start = false;

  [[nodiscard]] double Cost(std::size_t m) const { return model[m].sum_squares / variance; }
  [[nodiscard]] bool Near(double t) const {
    return std::abs(t - model[kQuadratic].t) <= kMostShift * model[kQuadratic].t;
  }
};

Candidates FindCandidates(const PressProfile& profile, Scan scan, double inflation,
                          BreakEstimate& result) {
  Candidates found;
  for (const std::size_t m : {kLinear, kQuadratic, kCubic}) {
    found.model[m] = FindMinimum(profile, scan, m);
  }
  if (found.model[kQuadratic].sum_squares == kNever) {
    return found;
  }
  found.power = FitPowerPress(profile, found.model[kQuadratic].t);
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
  const double freedom = std::max(1.0, profile.Totals()[0] - kUnknowns);
  const double least = std::min({found.model[kQuadratic].sum_squares,
                                 found.model[kCubic].sum_squares * freedom / (freedom - 1),
                                 found.model[kPower].sum_squares});
  // Noise-free samples leave rounding only; the floor keeps quotients finite.
  const double floor = 1e-24 * profile.Totals()[5] / freedom;
  result.noise = std::sqrt(std::max(least / freedom, floor));
  found.variance = inflation * result.noise * result.noise;
  result.sum_squares = least;
  result.straight_excess = (found.model[kLinear].sum_squares - least) / found.variance;
  found.reach = Quantile(freedom) * Quantile(freedom);
  return found;
}

class Interval95 {
 public:
  Interval95(const PressProfile& profile, const Candidates& candidates)
      : profile_(profile), candidates_(candidates) {
    const double neighbours = std::min(candidates.Cost(kCubic) + kCubicInterval,
                                       candidates.Cost(kPower) + kPowerInterval);
    const double quadratic = candidates.Cost(kQuadratic);
    level_ = std::min(quadratic, neighbours) + candidates.reach;
    const double credited = candidates.flat_start ? quadratic : neighbours + kCredit;
    quadratic_ = std::max(std::min(quadratic, credited) + candidates.reach, level_);
  }

  // False where it runs into the edge of the scan.
  bool Find(Scan scan, BreakEstimate& result) {
    Seed();
    std::size_t first = 0;
    std::size_t last = scan.size();
    while (first < scan.size() && !Holds(scan[first])) {
      ++first;
    }
    while (last > 0 && !Holds(scan[last - 1])) {
      --last;
    }
    if (first == 0 || last == scan.size()) {
      return false;
    }
    // Where no sample lies inside, the borders lie beside the minima.
    const bool any = first < last;
    const double lo = any ? std::min(lo_, scan[first].t) : lo_;
    const double hi = any ? std::max(hi_, scan[last - 1].t) : hi_;
    const auto above = std::upper_bound(scan.begin(), scan.end(), hi,
                                        [](double t, const auto& at) { return t < at.t; });
    const auto from = std::lower_bound(scan.begin(), scan.end(), lo,
                                       [](const auto& at, double t) { return at.t < t; });
    if (from == scan.begin() || above == scan.end()) {
      return false;
    }
    const auto margin = [this](double t) { return Margin(profile_.Evaluate(t)); };
    const double scale = BreakScale(*from, profile_.Below(lo), candidates_.variance);
    result.lo = FindBorder(lo, std::prev(from)->t, scale, margin);
    result.hi = FindBorder(hi, above->t, scale, margin);
    AddPower(result);
    return true;
  }

 private:
  // The minima that belong to the interval.
  void Seed() {
    lo_ = kNever;
    hi_ = -kNever;
    if (candidates_.Cost(kQuadratic) <= quadratic_) {
      lo_ = hi_ = candidates_.model[kQuadratic].t;
    }
    if (candidates_.Cost(kCubic) + kCubicInterval <= level_) {
      lo_ = std::min(lo_, candidates_.model[kCubic].t);
      hi_ = std::max(hi_, candidates_.model[kCubic].t);
    }
    if (lo_ == kNever) {
      lo_ = hi_ = candidates_.power.t;
    }
  }

  // Positive inside, by the model that gives most room.
  [[nodiscard]] double Margin(const PressProfile::At& at) const {
    const double quadratic = quadratic_ * candidates_.variance - SumSquares(at, kQuadratic);
    const bool ask_cubic = candidates_.model[kCubic].sum_squares < kNever && candidates_.Near(at.t);
    const double cubic =
        ask_cubic ? (level_ - kCubicInterval) * candidates_.variance - SumSquares(at, kCubic)
                  : -kNever;
    return std::max(quadratic, cubic);
  }
  [[nodiscard]] bool Holds(const PressProfile::At& at) const { return Margin(at) >= 0; }

  void AddPower(BreakEstimate& result) const {
    const double left = level_ - candidates_.Cost(kPower) - kPowerInterval;
    if (left > 0) {
      const PowerPress& power = candidates_.power;
      const double half = power.standard_deviation * std::sqrt(candidates_.variance * left);
      result.lo = std::min(result.lo, power.t - half);
      result.hi = std::max(result.hi, power.t + half);
    }
  }

  const PressProfile& profile_;
  const Candidates& candidates_;
  double level_ = 0;
  double quadratic_ = 0;
  double lo_ = 0;
  double hi_ = 0;
};

double Average(const Candidates& candidates, std::size_t& order) {
  constexpr std::array<double, kModels> kPenalty = {kLinearPoint, 0, kCubicPoint, kPowerPoint};
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

}  // namespace

BreakEstimate EstimateBreak(const PressProfile& profile, double inflation, Workspace& workspace) {
  BreakEstimate result;
  if (!profile.Ready()) {
    return result;
  }
  const Workspace::Scope scope(workspace);
  const Scan scan = ScanSamples(profile, workspace);
  if (scan.empty()) {
    return result;
  }
  const Candidates candidates = FindCandidates(profile, scan, inflation, result);
  if (candidates.variance == 0) {
    result.outcome = BreakEstimate::Outcome::kNoPress;
    return result;
  }
  result.quadratic_t = candidates.model[kQuadratic].t;
  result.cubic_t = candidates.model[kCubic].t;
  result.power_t = candidates.model[kPower].t;
  result.power_exponent = candidates.power.p;
  Interval95 interval(profile, candidates);
  if (!interval.Find(scan, result)) {
    result.outcome = BreakEstimate::Outcome::kAtEdge;
    return result;
  }
  result.t = std::clamp(Average(candidates, result.order), result.lo, result.hi);
  result.standard_uncertainty = 0.5 * (result.hi - result.lo) / std::sqrt(candidates.reach);
  result.below = profile.Below(result.t);
  result.outcome = BreakEstimate::Outcome::kFound;
  return result;
}

}  // namespace trammel::tap
