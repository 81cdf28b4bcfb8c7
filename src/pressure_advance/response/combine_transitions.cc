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

std::optional<double> CrossingWithout(const TransitionSeries& series, std::size_t left_out,
                                      const signal::ZeroCrossingOptions& options) {
  const auto without = [left_out](std::vector<double> values) {
    values.erase(values.begin() + static_cast<std::ptrdiff_t>(left_out));
    return values;
  };
  const auto fit = signal::FitZeroCrossing(without(series.pa_s), without(series.excess_s),
                                           without(series.sigma_s), options);
  if (!fit) return std::nullopt;
  return fit->zero;
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
    const auto zero_a = CrossingWithout(acceleration, i, options.acceleration);
    const auto zero_d = CrossingWithout(deceleration, i, options.deceleration);
    if (!zero_a || !zero_d) continue;
    a.push_back(*zero_a);
    d.push_back(*zero_d);
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

Common CommonShifts(const TransitionSeries& series, bool slope_has_scale,
                    const ResponseOptions& options) {
  const signal::ZeroCrossing& fit = series.crossing;
  Common common;
  common.slip = options.slip_sigma * series.slip_excess_s / fit.slope;
  const double missing = slope_has_scale ? std::max(0.0, options.full_slope - fit.slope) : 0;
  common.unread = options.unread_sigma * std::min(1.0, missing) * std::abs(fit.zero);
  const double outside = slope_has_scale ? std::clamp(1 - fit.slope, 0.0, 1.0) : 0;
  common.form =
      std::max(options.lag_form_sigma, options.lag_tail_sigma * outside) * std::abs(fit.zero);
  return common;
}

Measured Judge(double value, double lines_variance, double common_variance, double freedom,
               const Interval& tested, const ResponseOptions& options) {
  if (value < tested.lo || value > tested.hi) {
    return Measured::CannotTell(fmt::format(
        "the answer lies {} the tested range {:.4g} to {:.4g} s (about {:.3g} s): print again with "
        "a range around it",
        value < tested.lo ? "below" : "above", tested.lo, tested.hi, value));
  }
  const double u = std::sqrt(lines_variance + common_variance);
  // Welch and Satterthwaite: only the lines' part has few degrees of freedom.
  const double ratio = lines_variance > 0 ? u * u / lines_variance : 1e6;
  const double half = StudentT95(std::max(1.0, freedom) * ratio * ratio) * u;
  const double range = tested.hi - tested.lo;
  if (!(half <= options.widest_interval * range)) {
    return Measured::CannotTell(
        fmt::format("the lines scatter too much: the 95 % interval would reach {:.2g} s to either "
                    "side on a tested range of "
                    "{:.2g} s; print more lines, or clean the plate and scan again",
                    half, range));
  }
  return Measured::Good({value, u, {value - half, value + half}});
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

Measured WeighedMean(const Pair& pair, double freedom, const Interval& tested,
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
                                       const TransitionSeries& deceleration, bool slope_has_scale,
                                       const ResponseOptions& options) {
  const std::size_t count = acceleration.pa_s.size();
  TRAMMEL_CHECK(count == deceleration.pa_s.size() && count >= 2, "{} and {} lines", count,
                deceleration.pa_s.size());
  const auto [lo, hi] = std::minmax_element(acceleration.pa_s.begin(), acceleration.pa_s.end());
  const Interval tested{*lo, *hi};
  // A crossing, a slope and a bend are fitted.
  const double freedom = static_cast<double>(count) - 3;

  Pair pair{acceleration.crossing, deceleration.crossing,
            Jackknife(acceleration, deceleration, options),
            CommonShifts(acceleration, slope_has_scale, options),
            CommonShifts(deceleration, slope_has_scale, options)};
  pair.lines.aa = std::max(pair.lines.aa, Floor(pair.a));
  pair.lines.dd = std::max(pair.lines.dd, Floor(pair.d));

  const std::string doubt_a = Doubt(pair.a, slope_has_scale, options);
  const std::string doubt_d = Doubt(pair.d, slope_has_scale, options);
  const auto alone = [&](const std::string& doubt, const signal::ZeroCrossing& fit, double lines,
                         const Common& common) {
    if (!doubt.empty()) return Measured::CannotTell(doubt);
    return Judge(fit.zero, lines, Square(common.slip) + Square(common.unread) + Square(common.form),
                 freedom, tested, options);
  };
  CombinedTransitions result;
  result.acceleration = alone(doubt_a, pair.a, pair.lines.aa, pair.common_a);
  result.deceleration = alone(doubt_d, pair.d, pair.lines.dd, pair.common_d);

  // One transition that does not answer leaves the other; one that answers the wrong way round says
  // that the lines are not what they are taken for.
  if (AnswersBackwards(pair.d, options) || (!doubt_a.empty() && !doubt_d.empty())) {
    result.both = Measured::CannotTell(AnswersBackwards(pair.d, options) ? doubt_d : doubt_a);
  } else if (AnswersBackwards(pair.a, options)) {
    result.both = Measured::CannotTell(doubt_a);
  } else if (!doubt_a.empty() || !doubt_d.empty()) {
    result.both = doubt_a.empty() ? result.acceleration : result.deceleration;
    result.notices.push_back(fmt::format("only the {} counts: at the other transition {}",
                                         doubt_a.empty() ? "acceleration" : "deceleration",
                                         doubt_a.empty() ? doubt_d : doubt_a));
  } else {
    result.both = WeighedMean(pair, freedom, tested, options, result.notices);
  }
  return result;
}

}  // namespace trammel::pressure_advance
