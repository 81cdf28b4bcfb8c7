#include "pressure_advance/response.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <set>

#include "base/statistics.h"
#include "pressure_advance/excess.h"
#include "pressure_advance/responding_stretch.h"

namespace trammel::pressure_advance {
namespace {

// One transition of all usable lines, in seconds.
struct Series {
  std::vector<double> pa;
  std::vector<double> excess;
  std::vector<double> sigma;
};

Series Without(const Series& series, std::size_t left_out) {
  Series rest = series;
  const auto at = static_cast<std::ptrdiff_t>(left_out);
  rest.pa.erase(rest.pa.begin() + at);
  rest.excess.erase(rest.excess.begin() + at);
  rest.sigma.erase(rest.sigma.begin() + at);
  return rest;
}

std::optional<signal::ZeroCrossing> Fit(const Series& series,
                                        const signal::ZeroCrossingOptions& options) {
  return signal::FitZeroCrossing(series.pa, series.excess, series.sigma, options);
}

// Covariance of the two crossings, from leaving out one line at a time: the two share the lines,
// and with them each line's own lag.
struct Covariance {
  double aa = 0;
  double ad = 0;
  double dd = 0;
};

Covariance Jackknife(const Series& acceleration, const Series& deceleration,
                     const ResponseOptions& options) {
  std::vector<double> a, d;
  for (std::size_t i = 0; i < acceleration.pa.size(); ++i) {
    const auto fit_a = Fit(Without(acceleration, i), options.acceleration);
    const auto fit_d = Fit(Without(deceleration, i), options.deceleration);
    if (!fit_a || !fit_d) continue;
    a.push_back(fit_a->zero);
    d.push_back(fit_d->zero);
  }
  Covariance covariance;
  if (a.size() < 2) return covariance;
  const double mean_a = Mean(a);
  const double mean_d = Mean(d);
  for (std::size_t i = 0; i < a.size(); ++i) {
    covariance.aa += (a[i] - mean_a) * (a[i] - mean_a);
    covariance.ad += (a[i] - mean_a) * (d[i] - mean_d);
    covariance.dd += (d[i] - mean_d) * (d[i] - mean_d);
  }
  const double factor = (static_cast<double>(a.size()) - 1) / static_cast<double>(a.size());
  covariance.aa *= factor;
  covariance.ad *= factor;
  covariance.dd *= factor;
  return covariance;
}

// A jackknife over few lines is itself uncertain, and can come out far too small by chance: the
// fit's own standard error is its floor.
void ApplyFloor(double& variance, const signal::ZeroCrossing& fit) {
  const double plain = fit.residual_scale / std::max(std::abs(fit.slope), 1e-12);
  variance = std::max(variance, plain * plain / std::max(1.0, fit.points));
}

Measured Judge(double value, double variance_lines, double variance_form, double freedom, double lo,
               double hi, const ResponseOptions& options) {
  const double u = std::sqrt(variance_lines + variance_form);
  const double ratio = variance_lines > 0 ? (u * u) / variance_lines : 1e6;
  const double coverage = StudentT95(std::max(1.0, freedom) * ratio * ratio);
  if (value < lo || value > hi) {
    return Measured::CannotTell(fmt::format(
        "the answer lies {} the tested range {:.4g} to {:.4g} s (about {:.3g} s): print again with "
        "a range around it",
        value < lo ? "below" : "above", lo, hi, value));
  }
  const double half = coverage * u;
  if (!(half <= options.widest_interval * (hi - lo))) {
    return Measured::CannotTell(fmt::format(
        "the lines scatter too much: the 95 % interval would be +-{:.2g} s on a tested range of "
        "{:.2g} s; print more lines, or clean the plate and scan again",
        half, hi - lo));
  }
  return Measured::Good({value, u, {value - half, value + half}});
}

// Why a fitted crossing must not be believed; empty where it may be.
std::string Doubt(const signal::ZeroCrossing& fit, bool slope_has_scale,
                  const ResponseOptions& options) {
  const double significance = fit.slope_sigma > 0 ? fit.slope / fit.slope_sigma : 0;
  if (significance <= -options.least_significance) {
    return fmt::format(
        "the lines answer to pressure advance the wrong way round (slope {:.2g} +- {:.1g}): are "
        "the "
        "values in order, and is the side at which printing began right?",
        fit.slope, fit.slope_sigma);
  }
  if (significance < options.least_significance) {
    return fmt::format(
        "the lines do not answer clearly to pressure advance (slope {:.2g} +- {:.1g}, {:.1f} "
        "standard "
        "errors; {:.0f} are needed): test a wider range or a larger speed change",
        fit.slope, fit.slope_sigma, std::max(0.0, significance), options.least_significance);
  }
  if (slope_has_scale &&
      (fit.slope < options.plausible_slope.lo || fit.slope > options.plausible_slope.hi)) {
    return fmt::format(
        "the lines move {:.2f} times the filament that their pressure advance can move ({} to {} "
        "is "
        "plausible): check the values, the speeds and the line's length",
        fit.slope, options.plausible_slope.lo, options.plausible_slope.hi);
  }
  return {};
}

struct Prepared {
  TransitionPlan plan;
  std::vector<std::size_t> line;  // index of each usable line
  Series acceleration;
  Series deceleration;
  double unit_mm = 1;            // one unit of the profiles' positions; 1 where no length is known
  bool slope_has_scale = false;  // area over a known length: the slope is then near 1
};

// Excess of all lines in seconds: divided by the speed change. Where the line's length is unknown
// the scale is arbitrary until the slope is known.
Prepared Prepare(const std::vector<LineProfile>& profiles, const LineMotion& motion,
                 Reading reading, const TransitionPlan& plan, std::vector<LineResult>& lines) {
  Prepared prepared;
  prepared.plan = plan;
  const bool in_mm = profiles.front().position_unit == PositionUnit::kMillimetre;
  prepared.slope_has_scale = reading == Reading::kArea && (in_mm || motion.length_mm);
  prepared.unit_mm = in_mm ? 1.0 : motion.length_mm.value_or(1.0);
  const std::vector<LineExcess> measured_lines = MeasureExcess(profiles, reading, plan);
  for (std::size_t i = 0; i < profiles.size(); ++i) {
    const LineExcess& excess = measured_lines[i];
    if (!excess.unusable.empty()) {
      lines[i].reason = excess.unusable;
      continue;
    }
    lines[i].used = true;
    prepared.line.push_back(i);
    const auto add = [&](Series& series, const Excess& measured, const TransitionWindow& window) {
      const double seconds = prepared.unit_mm / std::abs(window.speed_change_mm_s);
      series.pa.push_back(profiles[i].pressure_advance_s);
      series.excess.push_back(measured.value * seconds);
      series.sigma.push_back(measured.sigma * seconds);
    };
    add(prepared.acceleration, excess.acceleration, plan.acceleration);
    add(prepared.deceleration, excess.deceleration, plan.deceleration);
  }
  return prepared;
}

// Where the fast segment has a steady middle, both windows are as wide as can be; only the stretch
// that answers to PA is kept. On a short line the whole window answers.
TransitionPlan NarrowWindows(const std::vector<LineProfile>& profiles, Reading reading,
                             const TransitionPlan& wide) {
  if (!wide.steady_middle) return wide;
  TransitionPlan plan = wide;
  const auto narrow = [&](TransitionWindow& window, bool rising) {
    const auto stretch = RespondingStretch(profiles, reading, window.span, rising);
    if (!stretch) return;
    const double fast_lo = rising ? std::max(window.boundary, stretch->lo) : stretch->lo;
    const double fast_hi = rising ? stretch->hi : std::min(window.boundary, stretch->hi);
    window.span = *stretch;
    window.fast_length = std::max(0.0, fast_hi - fast_lo);
  };
  narrow(plan.acceleration, true);
  narrow(plan.deceleration, false);
  return plan;
}

void Describe(const Prepared& prepared, const Series& series, const TransitionWindow& window,
              const signal::ZeroCrossing& fit, std::size_t lines, TransitionResult& result) {
  result.window_begin = window.span.lo;
  result.window_end = window.span.hi;
  result.excess_s.assign(lines, 0);
  result.sigma_s.assign(lines, 0);
  result.fitted_s.assign(lines, 0);
  // Without a length the scale is free: the slope is made 1, so that excess reads as error in PA.
  const double unit = prepared.slope_has_scale || fit.slope == 0 ? 1 : 1 / std::abs(fit.slope);
  constexpr double kIgnored = 0.05;
  for (std::size_t k = 0; k < series.pa.size(); ++k) {
    const std::size_t i = prepared.line[k];
    result.excess_s[i] = series.excess[k] * unit;
    result.fitted_s[i] = fit.fitted[k] * unit;
    if (fit.weight[k] > kIgnored) {
      result.sigma_s[i] = std::hypot(series.sigma[k], fit.residual_scale) * unit;
    }
  }
}

void Combine(const Prepared& prepared, const signal::ZeroCrossing& a, const signal::ZeroCrossing& d,
             const ResponseOptions& options, ResponseFit& fit) {
  const auto [lo_at, hi_at] =
      std::minmax_element(prepared.acceleration.pa.begin(), prepared.acceleration.pa.end());
  const double lo = *lo_at;
  const double hi = *hi_at;
  const double freedom = static_cast<double>(prepared.line.size()) - 3;
  Covariance lines = Jackknife(prepared.acceleration, prepared.deceleration, options);
  ApplyFloor(lines.aa, a);
  ApplyFloor(lines.dd, d);
  // A slope below what the windows should hold says that filament was there and not read.
  const auto unread = [&](const signal::ZeroCrossing& crossing) {
    const double missing = prepared.slope_has_scale ? options.full_slope - crossing.slope : 0;
    return std::pow(options.unread_sigma * std::clamp(missing, 0.0, 1.0) * crossing.zero, 2);
  };
  lines.aa += unread(a);
  lines.dd += unread(d);

  // How far a flow loss of 1 in the fast segment would move each crossing; opposite for the two.
  const auto slip_shift = [&](const TransitionWindow& window,
                              const signal::ZeroCrossing& crossing) {
    return window.fast_length * prepared.unit_mm / std::abs(window.speed_change_mm_s) /
           crossing.slope;
  };
  const double shift_a = slip_shift(prepared.plan.acceleration, a);
  const double shift_d = slip_shift(prepared.plan.deceleration, d);
  const double slip = options.slip_sigma * options.slip_sigma;
  // What of the lag's tail lies outside the window is known from the slope, where that has a scale.
  const auto form = [&](double value, double slope) {
    const double outside = prepared.slope_has_scale ? std::clamp(1 - slope, 0.0, 1.0) : 0;
    const double relative = std::max(options.lag_form_sigma, options.lag_tail_sigma * outside);
    return std::pow(relative * value, 2);
  };

  const std::string doubt_a = Doubt(a, prepared.slope_has_scale, options);
  const std::string doubt_d = Doubt(d, prepared.slope_has_scale, options);
  Measured& measured_a = fit.result.acceleration.pressure_advance;
  Measured& measured_d = fit.result.deceleration.pressure_advance;
  measured_a = doubt_a.empty()
                   ? Judge(a.zero, lines.aa, slip * shift_a * shift_a + form(a.zero, a.slope),
                           freedom, lo, hi, options)
                   : Measured::CannotTell(doubt_a);
  measured_d = doubt_d.empty()
                   ? Judge(d.zero, lines.dd, slip * shift_d * shift_d + form(d.zero, d.slope),
                           freedom, lo, hi, options)
                   : Measured::CannotTell(doubt_d);

  Measured& both = fit.result.pressure_advance;
  const auto contradicts = [&](const signal::ZeroCrossing& crossing) {
    return crossing.slope <= -options.least_significance * crossing.slope_sigma;
  };
  // One transition that does not answer leaves the other; one that answers the wrong way round says
  // that the lines are not what they are taken for.
  if ((!doubt_a.empty() && !doubt_d.empty()) || contradicts(a) || contradicts(d)) {
    both = Measured::CannotTell(contradicts(d) || doubt_a.empty() ? doubt_d : doubt_a);
    return;
  }
  if (!doubt_a.empty() || !doubt_d.empty()) {
    both = doubt_a.empty() ? measured_a : measured_d;
    fit.notices.push_back(fmt::format("only the {} counts: at the other transition {}",
                                      doubt_a.empty() ? "acceleration" : "deceleration",
                                      doubt_a.empty() ? doubt_d : doubt_a));
    return;
  }
  const double aa = lines.aa + slip * shift_a * shift_a;
  const double dd = lines.dd + slip * shift_d * shift_d;
  const double ad = lines.ad - slip * shift_a * shift_d;
  const double apart = aa + dd - 2 * ad;
  const double weight = apart > 0 ? std::clamp((dd - ad) / apart, 0.0, 1.0) : 0.5;
  const double value = weight * a.zero + (1 - weight) * d.zero;
  double variance = weight * weight * lines.aa + (1 - weight) * (1 - weight) * lines.dd +
                    2 * weight * (1 - weight) * lines.ad;
  variance = std::max(variance, 0.25 * std::min(lines.aa, lines.dd));
  const double slip_left = weight * shift_a - (1 - weight) * shift_d;

  // Two transitions of one extruder measure one quantity. Where they differ by more than twice
  // their uncertainty, the answer may lie anywhere between: a rectangular distribution over the
  // rest.
  const double difference = a.zero - d.zero;
  const double expected = 4 * std::max(apart, 1e-18);
  if (difference * difference > expected) {
    variance += (difference * difference - expected) / 12;
    fit.notices.push_back(fmt::format(
        "the acceleration ({:.4f} s) and the deceleration ({:.4f} s) suggest different values; the "
        "uncertainty was widened to cover it",
        a.zero, d.zero));
  }
  both =
      Judge(value, variance, slip * slip_left * slip_left + form(value, std::min(a.slope, d.slope)),
            freedom, lo, hi, options);
}

}  // namespace

ResponseFit FitResponse(const std::vector<LineProfile>& profiles, const LineMotion& motion,
                        const ResponseOptions& options) {
  ResponseFit fit;
  fit.lines.resize(profiles.size());
  for (std::size_t i = 0; i < profiles.size(); ++i) {
    fit.lines[i].pressure_advance_s = profiles[i].pressure_advance_s;
    fit.lines[i].reason = profiles[i].unusable;
  }
  const auto refuse = [&fit](const std::string& reason) {
    fit.result.pressure_advance = Measured::Refused(reason);
    fit.result.acceleration.pressure_advance = Measured::Refused(reason);
    fit.result.deceleration.pressure_advance = Measured::Refused(reason);
    return fit;
  };
  const std::optional<Reading> reading = ChooseReading(profiles);
  if (!reading) {
    std::string why = profiles.empty() ? "there are none" : profiles.front().unusable;
    return refuse(fmt::format("no line could be measured: {}", why));
  }
  double longest = 0;
  for (const LineProfile& profile : profiles)
    longest = std::max(longest, profile.pressure_advance_s);
  const Result<TransitionPlan> plan =
      PlanTransitions(motion, profiles.front().position_unit, longest, options.transitions);
  if (!plan) return refuse(plan.error().message);

  const Prepared prepared =
      Prepare(profiles, motion, *reading, NarrowWindows(profiles, *reading, *plan), fit.lines);
  const std::set<double> values(prepared.acceleration.pa.begin(), prepared.acceleration.pa.end());
  if (static_cast<int>(values.size()) < options.fewest_lines) {
    std::string why;
    for (const LineResult& line : fit.lines) {
      if (!line.used && why.empty()) {
        why = fmt::format("; the line at {:.4g} s: {}", line.pressure_advance_s, line.reason);
      }
    }
    return refuse(fmt::format(
        "{} of {} lines can be used with different pressure advance, at least {} are needed{}",
        values.size(), profiles.size(), options.fewest_lines, why));
  }
  const auto a = Fit(prepared.acceleration, options.acceleration);
  const auto d = Fit(prepared.deceleration, options.deceleration);
  TRAMMEL_CHECK(a && d, "{} different values", values.size());
  Describe(prepared, prepared.acceleration, prepared.plan.acceleration, *a, profiles.size(),
           fit.result.acceleration);
  Describe(prepared, prepared.deceleration, prepared.plan.deceleration, *d, profiles.size(),
           fit.result.deceleration);
  for (std::size_t i = 0; i < profiles.size(); ++i) {
    if (fit.lines[i].used && fit.result.acceleration.sigma_s[i] == 0 &&
        fit.result.deceleration.sigma_s[i] == 0) {
      fit.lines[i].used = false;
      fit.lines[i].reason = "does not follow the other lines";
    }
  }
  Combine(prepared, *a, *d, options, fit);
  return fit;
}

}  // namespace trammel::pressure_advance
