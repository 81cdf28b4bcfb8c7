#include "pressure_advance/response/combine_transitions.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <optional>

#include "base/check.h"
#include "base/square.h"
#include "base/statistics.h"
#include "pressure_advance/response/answer.h"

namespace trammel::pressure_advance {
namespace {

// Returns an answer if unclear lines suggest one far outside: all of them too low, or all too high,
// at both transitions.
std::optional<RangedAnswer> AllOnOneSide(const TransitionSeries& a, const TransitionSeries& d,
                                         const Interval& tested) {
  bool above = true, below = tested.lo > 0;
  for (const TransitionSeries* series : {&a, &d}) {
    for (std::size_t i = 0; i < series->pa_s.size(); ++i) {
      if (!std::isfinite(series->sigma_s[i])) continue;
      above &= series->surplus_s[i] > 2 * series->sigma_s[i];
      below &= series->surplus_s[i] < -2 * series->sigma_s[i];
    }
  }
  if (!above && !below) return std::nullopt;
  const double range = tested.hi - tested.lo;
  const Interval next = PrintNext(above ? tested.hi + range : tested.lo - range, tested);
  return RangedAnswer{
      Measured::CannotTell(fmt::format("the answer lies {} the tested range {:.4g} to {:.4g} s: on "
                                       "all {} lines filament {} where "
                                       "the nozzle speeds up and {} where it slows down; print a "
                                       "pattern from {:.3g} to {:.3g} s",
                                       above ? "above" : "below", tested.lo, tested.hi,
                                       a.pa_s.size(), above ? "is missing" : "is left over",
                                       above ? "is left over" : "is missing", next.lo, next.hi)),
      next};
}

bool AnswersBackwards(const signal::ZeroCrossing& fit, const ResponseOptions& options) {
  return fit.slope <= -options.min_significance * fit.slope_sigma;
}

// Returns the reason to reject a crossing beyond the lines that show its transition: the response
// is straight near it only, as a gap in the filament cannot get emptier than empty.
std::string BeyondItsLines(const TransitionSeries& series, double zero_s,
                           const ResponseOptions& options) {
  const Interval tested = RangeOf(series.pa_s);
  const double step_s = (tested.hi - tested.lo) / (static_cast<double>(series.pa_s.size()) - 1);
  if (series.Beyond_s(zero_s) <= options.max_beyond * step_s) return {};
  const std::vector<double> seen_s = series.SeenPa_s();
  const Interval seen = RangeOf(seen_s);
  return fmt::format(
      "the lines that show it, {} of {}, have pressure advances of {:.4g} to {:.4g} s, all {} the "
      "answer: show the whole lines",
      seen_s.size(), series.pa_s.size(), seen.lo, seen.hi, zero_s < seen.lo ? "above" : "below");
}

// Returns the reason to reject a crossing that the lines beside it do not follow: the curve was put
// through others, which may be alike because all of them are empty there.
std::string NotByItsLines(const signal::ZeroCrossing& fit, const TransitionSeries& series) {
  constexpr std::size_t kBeside = 5;
  constexpr int kFewest = 3;
  constexpr double kFollows = 0.05;  // weight, of 1
  std::vector<std::size_t> lines;
  for (std::size_t i = 0; i < series.pa_s.size(); ++i) {
    if (std::isfinite(series.sigma_s[i])) lines.push_back(i);
  }
  std::ranges::sort(lines, {}, [&](std::size_t i) { return std::abs(series.pa_s[i] - fit.zero); });
  lines.resize(std::min(lines.size(), kBeside));
  const auto follow =
      std::ranges::count_if(lines, [&](std::size_t i) { return fit.weight[i] > kFollows; });
  if (follow >= kFewest) return {};
  return fmt::format(
      "only {} of the {} lines nearest to {:.4g} s follow the others: print a narrower range",
      follow, lines.size(), fit.zero);
}

// Returns the reason to reject a fitted crossing; else empty.
std::string Doubt(const signal::ZeroCrossing& fit, const TransitionSeries& series,
                  bool slope_has_scale, const ResponseOptions& options) {
  if (AnswersBackwards(fit, options)) {
    return fmt::format(
        "the lines answer to pressure advance the wrong way round (slope {:.2g}, standard error "
        "{:.1g}): are "
        "the values in order, and are the side at which printing began, the scan's speed and its "
        "start right?",
        fit.slope, fit.slope_sigma);
  }
  const double significance = fit.slope_sigma > 0 ? fit.slope / fit.slope_sigma : 0;
  if (significance < options.min_significance) {
    return fmt::format(
        "the lines do not answer clearly to pressure advance (slope {:.2g}, standard error {:.1g}: "
        "{:.1f} "
        "standard errors; {:.0f} are needed): test a wider range or a larger speed change",
        fit.slope, fit.slope_sigma, std::max(0.0, significance), options.min_significance);
  }
  const Interval& plausible = options.plausible_slope;
  if (slope_has_scale && (fit.slope < plausible.lo || fit.slope > plausible.hi)) {
    return fmt::format(
        "the lines move {:.2f} times the filament that their pressure advance can move ({} to {} "
        "is plausible): check the values, the speeds and the line's length",
        fit.slope, plausible.lo, plausible.hi);
  }
  if (auto not_by_its_lines = NotByItsLines(fit, series); !not_by_its_lines.empty()) {
    return not_by_its_lines;
  }
  return BeyondItsLines(series, fit.zero, options);
}

// Correction and uncertainty for a lag that drifts over the pattern: the crossing is the lag of the
// line printed there, the mean line's is elsewhere. The answer is half way between the two.
struct Drift {
  double shift_s = 0;
  double variance = 0;
};

Drift EstimateDrift(const Transitions& transitions, const signal::ZeroCrossing& fit, double tail_s,
                    double slip, const ResponseOptions& options) {
  const double off_centre_s =
      fit.zero - options.printed_middle_s.value_or(Mean(transitions.acceleration.pa_s));
  // Slip grows with the flow: it removes a greater share of the filament added by pressure advance
  // than of the rest.
  constexpr double kSlipOfTheSlope = 1.3;
  const double slip_slope = 1 - kSlipOfTheSlope * std::max(0.0, slip);
  LagDrift drift{0, options.drift.unseen_sigma};
  if (transitions.ramp_s > 0 && fit.zero > 0 && fit.slope > 0) {
    const double gain =
        slip_slope * GainOfALinearLag(fit.zero, transitions.ramp_s, transitions.drain_s);
    drift = EstimateLagDrift(fit.slope, fit.slope_sigma, gain, tail_s / fit.zero, options.drift);
  }
  // Fraction of the distance between the two. A slope above the gain is only drift; below it may be
  // unread filament, which has a term of its own.
  const double left_open = drift.mean < 0 ? 0.8 : 0.5;
  return {-drift.mean / 2 * off_centre_s,
          Square(off_centre_s) * (Square(left_open * drift.mean) + Square(drift.sigma))};
}

// Values common to both transitions and to their mean.
struct Shared {
  Drift drift;
  double slip_form_s = 0;
  double picture_s = 0;
  double freedom = 0;
  Interval tested;
  double widest = 0;  // half width of an interval, as a part of the tested range
};

BudgetedValue WeighedMean(const CrossingPair& pair, const Shared& shared,
                          std::vector<std::string>& notices) {
  const CommonShifts& ca = pair.acceleration.common;
  const CommonShifts& cd = pair.deceleration.common;
  const double lines_aa = pair.acceleration.variance;
  const double lines_dd = pair.deceleration.variance;
  const double aa = lines_aa + Square(ca.slip) + Square(ca.unread);
  const double dd = lines_dd + Square(cd.slip) + Square(cd.unread);
  const double ad = pair.covariance - ca.slip * cd.slip + ca.unread * cd.unread;
  const double apart = aa + dd - 2 * ad;
  const double w = apart > 0 ? std::clamp((dd - ad) / apart, 0.0, 1.0) : 0.5;
  const double v = 1 - w;

  UncertaintyBudget budget;
  // Two transitions of the same lines never halve the standard deviation of the better one.
  budget.lines = std::max(w * w * lines_aa + v * v * lines_dd + 2 * w * v * pair.covariance,
                          0.25 * std::min(lines_aa, lines_dd));
  budget.slip = Square(w * ca.slip - v * cd.slip) + Square(shared.slip_form_s);
  budget.unread = Square(w * ca.unread + v * cd.unread);
  budget.form = Square(w * ca.form + v * cd.form);
  budget.drift = shared.drift.variance;
  budget.picture = Square(shared.picture_s);

  const double a_s = pair.acceleration.zero_s;
  const double d_s = pair.deceleration.zero_s;
  const double explained = 4 * std::max(apart, 1e-18);
  if (Square(a_s - d_s) > explained) {
    budget.apart = (Square(a_s - d_s) - explained) / 12;
    notices.push_back(
        NoticeOfTransitions(a_s, d_s, std::abs(a_s - d_s) / std::sqrt(std::max(apart, 1e-18))));
  }
  return {w * a_s + v * d_s + shared.drift.shift_s, budget};
}

}  // namespace

std::string NoticeOfTransitions(double acceleration_s, double deceleration_s, double sigmas) {
  return fmt::format(
      "the acceleration ({:.4f} s) and the deceleration ({:.4f} s) suggest values that differ by "
      "{:.1f} standard uncertainties; the answer's uncertainty was widened for it",
      acceleration_s, deceleration_s, sigmas);
}

CombinedTransitions CombineTransitions(const Transitions& transitions,
                                       const TransitionCrossings& crossings, bool slope_has_scale,
                                       const ResponseOptions& options) {
  const TransitionSeries& acceleration = transitions.acceleration;
  const TransitionSeries& deceleration = transitions.deceleration;
  const std::size_t count = acceleration.pa_s.size();
  TRAMMEL_CHECK(count == deceleration.pa_s.size() && count >= 2, "{} and {} lines", count,
                deceleration.pa_s.size());
  const Interval tested = RangeOf(acceleration.pa_s);

  const CrossingPair pair = CorrectCrossings(transitions, crossings, slope_has_scale, options);
  const std::string doubt_a = Doubt(crossings.acceleration, acceleration, slope_has_scale, options);
  const std::string doubt_d = Doubt(crossings.deceleration, deceleration, slope_has_scale, options);
  const bool doubtful = !doubt_a.empty() || !doubt_d.empty();
  const Slip slip = doubtful ? Slip{} : EstimateSlip(pair);
  const double slip_share = slip.mean * options.slip_sigma;
  const auto shown =
      static_cast<double>(std::min(acceleration.SeenPa_s().size(), deceleration.SeenPa_s().size()));
  // Three parameters are fitted: a crossing, a slope and a bend.
  const Shared shared{
      .drift = EstimateDrift(transitions, crossings.acceleration, pair.tail_s, slip_share, options),
      .slip_form_s =
          options.slip_form_sigma * std::max(0.0, slip_share) * std::abs(pair.acceleration.zero_s),
      .picture_s = options.picture_sigma * (tested.hi - tested.lo),
      .freedom = std::max(1.0, shown - 3),
      .tested = tested,
      .widest = std::max(options.widest_interval, 0.5 / (static_cast<double>(count) - 1))};

  const PairVariances lines =
      LessSlip({pair.acceleration.variance, pair.deceleration.variance, pair.covariance}, slip);
  const double forms_apart = pair.acceleration.common.form - pair.deceleration.common.form;
  const auto alone = [&](double value_s, const CorrectedCrossing& crossing, double variance,
                         double moved) {
    BudgetedValue answer{value_s, {}};
    answer.budget = {.lines = variance,
                     .slip = Square(crossing.common.slip * slip.variance) +
                             Square(moved * forms_apart) + Square(shared.slip_form_s),
                     .unread = Square(crossing.common.unread),
                     .form = Square(crossing.common.form),
                     .drift = shared.drift.variance,
                     .picture = Square(shared.picture_s)};
    return answer;
  };
  const auto judged = [&](const std::string& doubt, const BudgetedValue& answer) {
    if (!doubt.empty()) return RangedAnswer{Measured::CannotTell(doubt), std::nullopt};
    return JudgeByBudget(answer.value_s, answer.budget, shared.freedom, tested, shared.widest);
  };
  CombinedTransitions result;
  result.pair = pair;
  result.slip = slip;
  result.freedom = shared.freedom;
  result.tested = tested;
  result.widest = shared.widest;
  const double value_a_s =
      pair.acceleration.zero_s - slip.mean * pair.acceleration.common.slip + shared.drift.shift_s;
  const double value_d_s =
      pair.deceleration.zero_s + slip.mean * pair.deceleration.common.slip + shared.drift.shift_s;
  const BudgetedValue budgeted_a =
      alone(value_a_s, pair.acceleration, lines.acceleration, slip.off_acceleration);
  const BudgetedValue budgeted_d =
      alone(value_d_s, pair.deceleration, lines.deceleration, slip.on_deceleration);
  const RangedAnswer alone_a = judged(doubt_a, budgeted_a);
  const RangedAnswer alone_d = judged(doubt_d, budgeted_d);
  result.acceleration = alone_a.pressure_advance;
  result.deceleration = alone_d.pressure_advance;
  result.acceleration_shift_s = value_a_s - crossings.acceleration.zero;
  result.deceleration_shift_s = value_d_s - crossings.deceleration.zero;

  // If one transition does not respond, the other is used; a response of the wrong sign shows that
  // the lines are not as assumed.
  const bool backwards_a = AnswersBackwards(crossings.acceleration, options);
  const bool backwards_d = AnswersBackwards(crossings.deceleration, options);
  const auto one_side = doubtful && !backwards_a && !backwards_d
                            ? AllOnOneSide(acceleration, deceleration, tested)
                            : std::nullopt;
  if (one_side) {
    result.both = *one_side;
  } else if (backwards_d || (!doubt_a.empty() && !doubt_d.empty())) {
    result.both = backwards_d ? alone_d : alone_a;
  } else if (backwards_a) {
    result.both = alone_a;
  } else if (doubtful) {
    result.both = doubt_a.empty() ? alone_a : alone_d;
    result.notices.push_back(fmt::format("only the {} counts: at the other transition {}",
                                         doubt_a.empty() ? "acceleration" : "deceleration",
                                         doubt_a.empty() ? doubt_d : doubt_a));
  } else {
    result.whole = WeighedMean(pair, shared, result.notices);
    result.first = budgeted_a;
    result.second = budgeted_d;
    result.both = judged({}, *result.whole);
  }
  return result;
}

}  // namespace trammel::pressure_advance
