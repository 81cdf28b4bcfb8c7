#include "pressure_advance/response/combine_transitions.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <optional>

#include "base/check.h"
#include "base/statistics.h"

namespace trammel::pressure_advance {
namespace {

double Square(double x) { return x * x; }

TransitionSeries Without(TransitionSeries series, std::size_t left_out) {
  const auto drop = [left_out](std::vector<double>& values) {
    values.erase(values.begin() + static_cast<std::ptrdiff_t>(left_out));
  };
  drop(series.pa_s);
  drop(series.excess_s);
  drop(series.sigma_s);
  return series;
}

// Of the two crossings, from the scatter of the lines.
struct Covariance {
  double aa = 0;
  double ad = 0;
  double dd = 0;
};

Covariance Jackknife(const TransitionSeries& acceleration, const TransitionSeries& deceleration,
                     const ResponseOptions& options) {
  std::vector<double> a, d;
  for (std::size_t i = 0; i < acceleration.pa_s.size(); ++i) {
    const auto fit = FitTransitions(Without(acceleration, i), Without(deceleration, i), options);
    if (!fit) continue;
    a.push_back(fit->acceleration.zero);
    d.push_back(fit->deceleration.zero);
  }
  Covariance covariance;
  if (a.size() < 2) return covariance;
  const double mean_a = Mean(a);
  const double mean_d = Mean(d);
  const double factor = (static_cast<double>(a.size()) - 1) / static_cast<double>(a.size());
  for (std::size_t i = 0; i < a.size(); ++i) {
    covariance.aa += factor * (a[i] - mean_a) * (a[i] - mean_a);
    covariance.ad += factor * (a[i] - mean_a) * (d[i] - mean_d);
    covariance.dd += factor * (d[i] - mean_d) * (d[i] - mean_d);
  }
  return covariance;
}

// A jackknife over few lines is itself uncertain, and can come out far too small by chance: the
// fit's own standard error is its floor.
double Floor(const signal::ZeroCrossing& fit) {
  const double plain = fit.residual_scale / std::max(std::abs(fit.slope), 1e-12);
  return plain * plain / std::max(1.0, fit.points);
}

// What every line shares, so that leaving lines out does not show it. Each is the shift of the
// crossing by one standard deviation; s.
struct Common {
  double slip = 0;    // opposite for the two transitions
  double unread = 0;  // filament beside what the eye reads
  double form = 0;    // of the lag's law, as far as the window leaves it open
};

Common CommonShifts(const TransitionSeries& series, const signal::ZeroCrossing& fit,
                    bool slope_has_scale, const ResponseOptions& options) {
  Common common;
  common.slip = options.slip_sigma * series.slip_excess_s / fit.slope;
  const double missing = slope_has_scale ? std::max(0.0, options.full_slope - fit.slope) : 0;
  common.unread = options.unread_sigma * std::min(1.0, missing) * std::abs(fit.zero);
  const double outside = slope_has_scale ? std::clamp(1 - fit.slope, 0.0, 1.0) : 0;
  common.form =
      std::max(options.lag_form_sigma, options.lag_tail_sigma * outside) * std::abs(fit.zero);
  return common;
}

RangedAnswer Judge(double value, double lines_variance, double common_variance, double freedom,
                   const Interval& tested, const ResponseOptions& options) {
  const double u = std::sqrt(lines_variance + common_variance);
  // Welch and Satterthwaite: only the lines' part has few degrees of freedom.
  const double ratio = lines_variance > 0 ? u * u / lines_variance : 1e6;
  const double half = StudentT95(std::max(1.0, freedom) * ratio * ratio) * u;
  const std::string too_wide = fmt::format(
      "the lines scatter too much: the 95 % interval would reach {:.2g} s to either side on a "
      "tested range of {:.2g} s; print more lines, or clean the plate and scan again",
      half, tested.hi - tested.lo);
  return JudgeInRange(value, u, half, tested, options.widest_interval, too_wide);
}

// Where lines that do not answer clearly may do so because the answer is far outside: all of them
// too low, or all too high, at both transitions.
std::optional<RangedAnswer> AllOnOneSide(const TransitionSeries& a, const TransitionSeries& d,
                                         const Interval& tested) {
  bool above = true, below = tested.lo > 0;
  for (const TransitionSeries* series : {&a, &d}) {
    for (std::size_t i = 0; i < series->pa_s.size(); ++i) {
      above &= series->excess_s[i] > 2 * series->sigma_s[i];
      below &= series->excess_s[i] < -2 * series->sigma_s[i];
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
  return fit.slope <= -options.least_significance * fit.slope_sigma;
}

// Why a fitted crossing must not be believed; empty where it may be.
std::string Doubt(const signal::ZeroCrossing& fit, bool slope_has_scale,
                  const ResponseOptions& options) {
  if (AnswersBackwards(fit, options)) {
    return fmt::format(
        "the lines answer to pressure advance the wrong way round (slope {:.2g}, standard error "
        "{:.1g}): are "
        "the values in order, and are the side at which printing began, the scan's speed and its "
        "start right?",
        fit.slope, fit.slope_sigma);
  }
  const double significance = fit.slope_sigma > 0 ? fit.slope / fit.slope_sigma : 0;
  if (significance < options.least_significance) {
    return fmt::format(
        "the lines do not answer clearly to pressure advance (slope {:.2g}, standard error {:.1g}: "
        "{:.1f} "
        "standard errors; {:.0f} are needed): test a wider range or a larger speed change",
        fit.slope, fit.slope_sigma, std::max(0.0, significance), options.least_significance);
  }
  const Interval& plausible = options.plausible_slope;
  if (slope_has_scale && (fit.slope < plausible.lo || fit.slope > plausible.hi)) {
    return fmt::format(
        "the lines move {:.2f} times the filament that their pressure advance can move ({} to {} "
        "is plausible): check the values, the speeds and the line's length",
        fit.slope, plausible.lo, plausible.hi);
  }
  return {};
}

// A pair of crossings whose covariance is known.
struct Pair {
  const signal::ZeroCrossing& a;
  const signal::ZeroCrossing& d;
  Covariance lines;
  Common common_a;
  Common common_d;
};

RangedAnswer WeighedMean(const Pair& pair, double freedom, const Interval& tested,
                         const ResponseOptions& options, std::vector<std::string>& notices) {
  const auto& [a, d, lines, ca, cd] = pair;
  const double aa = lines.aa + Square(ca.slip) + Square(ca.unread);
  const double dd = lines.dd + Square(cd.slip) + Square(cd.unread);
  const double ad = lines.ad - ca.slip * cd.slip + ca.unread * cd.unread;
  const double apart = aa + dd - 2 * ad;
  const double w = apart > 0 ? std::clamp((dd - ad) / apart, 0.0, 1.0) : 0.5;
  const double v = 1 - w;

  double lines_variance = w * w * lines.aa + v * v * lines.dd + 2 * w * v * lines.ad;
  // Two transitions of the same lines never halve the standard deviation of the better one.
  lines_variance = std::max(lines_variance, 0.25 * std::min(lines.aa, lines.dd));
  double common_variance = Square(w * ca.slip - v * cd.slip) +
                           Square(w * ca.unread + v * cd.unread) +
                           Square(w * ca.form + v * cd.form);

  const double difference = a.zero - d.zero;
  const double explained = 4 * std::max(apart, 1e-18);
  if (difference * difference > explained) {
    common_variance += (difference * difference - explained) / 12;
    notices.push_back(fmt::format(
        "the acceleration ({:.4f} s) and the deceleration ({:.4f} s) suggest values that differ by "
        "{:.1f} standard uncertainties; the answer's uncertainty was widened for it",
        a.zero, d.zero, std::abs(difference) / std::sqrt(std::max(apart, 1e-18))));
  }
  return Judge(w * a.zero + v * d.zero, lines_variance, common_variance, freedom, tested, options);
}

}  // namespace

CombinedTransitions CombineTransitions(const TransitionSeries& acceleration,
                                       const TransitionSeries& deceleration,
                                       const TransitionCrossings& crossings, bool slope_has_scale,
                                       const ResponseOptions& options) {
  const std::size_t count = acceleration.pa_s.size();
  TRAMMEL_CHECK(count == deceleration.pa_s.size() && count >= 2, "{} and {} lines", count,
                deceleration.pa_s.size());
  const Interval tested = RangeOf(acceleration.pa_s);
  // A crossing, a slope and a bend are fitted.
  const double freedom = static_cast<double>(count) - 3;

  Pair pair{crossings.acceleration, crossings.deceleration,
            Jackknife(acceleration, deceleration, options),
            CommonShifts(acceleration, crossings.acceleration, slope_has_scale, options),
            CommonShifts(deceleration, crossings.deceleration, slope_has_scale, options)};
  pair.lines.aa = std::max(pair.lines.aa, Floor(pair.a));
  pair.lines.dd = std::max(pair.lines.dd, Floor(pair.d));

  const std::string doubt_a = Doubt(pair.a, slope_has_scale, options);
  const std::string doubt_d = Doubt(pair.d, slope_has_scale, options);
  const auto alone = [&](const std::string& doubt, const signal::ZeroCrossing& fit, double lines,
                         const Common& common) {
    if (!doubt.empty()) return RangedAnswer{Measured::CannotTell(doubt), std::nullopt};
    return Judge(fit.zero, lines, Square(common.slip) + Square(common.unread) + Square(common.form),
                 freedom, tested, options);
  };
  const RangedAnswer alone_a = alone(doubt_a, pair.a, pair.lines.aa, pair.common_a);
  const RangedAnswer alone_d = alone(doubt_d, pair.d, pair.lines.dd, pair.common_d);
  CombinedTransitions result;
  result.acceleration = alone_a.pressure_advance;
  result.deceleration = alone_d.pressure_advance;

  // One transition that does not answer leaves the other; one that answers the wrong way round says
  // that the lines are not what they are taken for.
  const bool backwards = AnswersBackwards(pair.a, options) || AnswersBackwards(pair.d, options);
  const bool doubtful = !doubt_a.empty() || !doubt_d.empty();
  const auto one_side =
      doubtful && !backwards ? AllOnOneSide(acceleration, deceleration, tested) : std::nullopt;
  if (one_side) {
    result.both = *one_side;
  } else if (AnswersBackwards(pair.d, options) || (!doubt_a.empty() && !doubt_d.empty())) {
    result.both = AnswersBackwards(pair.d, options) ? alone_d : alone_a;
  } else if (AnswersBackwards(pair.a, options)) {
    result.both = alone_a;
  } else if (doubtful) {
    result.both = doubt_a.empty() ? alone_a : alone_d;
    result.notices.push_back(fmt::format("only the {} counts: at the other transition {}",
                                         doubt_a.empty() ? "acceleration" : "deceleration",
                                         doubt_a.empty() ? doubt_d : doubt_a));
  } else {
    result.both = WeighedMean(pair, freedom, tested, options, result.notices);
  }
  return result;
}

}  // namespace trammel::pressure_advance
