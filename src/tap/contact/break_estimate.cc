#include "tap/contact/break_estimate.h"

#include <algorithm>
#include <array>
#include <cmath>

#include "tap/contact/break_interval.h"
#include "tap/contact/break_models.h"
#include "tap/contact/break_search.h"
#include "tap/samples/line_fit.h"

namespace trammel::tap {
namespace {

// Costs of a model's answer as the point, in variances of the noise: answers with more scatter must
// explain the samples much better.
constexpr double kLinearPoint = -3;  // one coefficient less: Akaike's 2, and the common press
constexpr double kCubicPoint = 8;
constexpr double kPowerPoint = 8;
constexpr double kZonesPoint = 20;
constexpr double kZonesShape = 16;  // like the form subtracted from the residuals

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

// Returns the cubic press at the estimate, the most flexible smooth one, unless another one
// explains the samples better: its residuals contain the most noise and the least misfit.
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
  result.candidates = FindCandidates(profile, scan, task.inflation);
  const Candidates& candidates = result.candidates;
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
    const double quantile = Student95(candidates.freedom);
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
