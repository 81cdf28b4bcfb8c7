#include "pressure_advance/response/crossing_pair.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <utility>
#include <vector>

#include "base/square.h"
#include "pressure_advance/response/lag_drift.h"

namespace trammel::pressure_advance {
namespace {

// Covariance of acceleration, deceleration and tail, in this order; s^2.
using Covariance = std::array<std::array<double, 3>, 3>;

// By how far each line's residual moved a crossing.
std::vector<double> MovedBy(const TransitionSeries& series, const signal::ZeroCrossing& fit) {
  std::vector<double> moved_s;
  for (std::size_t i = 0; i < series.pa_s.size(); ++i) {
    moved_s.push_back(fit.influence[i] * (series.excess_s[i] - fit.fitted[i]));
  }
  return moved_s;
}

// The deceleration's crossing from its own fit, and from the acceleration's less what the two
// transitions of one line differ by.
struct Deceleration {
  double zero_s = 0;
  double slope = 0;
  double own = 1;   // weight of its own fit
  double form = 0;  // variance from what the priors leave open, s^2
  std::vector<double> moved_s;
};

Deceleration WeighDeceleration(const TransitionCrossings& crossings,
                               const std::vector<double>& moved_a_s,
                               std::vector<double> moved_d_s) {
  const signal::ZeroCrossing& a = crossings.acceleration;
  const signal::ZeroCrossing& d = crossings.deceleration;
  Deceleration result{d.zero, d.slope, 1, Square(d.bend_shift), std::move(moved_d_s)};
  if (!crossings.paired) return result;
  const PairedDifference& paired = *crossings.paired;
  double apart = Square(d.bend_shift);
  for (std::size_t i = 0; i < moved_a_s.size(); ++i) {
    apart += Square(result.moved_s[i] - moved_a_s[i]);
  }
  const double paired_form = Square(paired.form_s / a.slope);
  const double paired_variance = paired.variance() / Square(a.slope);
  const double w = paired.cut_off ? 0 : paired_variance / (paired_variance + apart);
  result.own = w;
  result.zero_s = w * d.zero + (1 - w) * (a.zero - paired.value_s / a.slope);
  result.slope = w * d.slope + (1 - w) * a.slope;
  result.form =
      w * w * Square(d.bend_shift) + (1 - w) * (1 - w) * (paired_form + Square(a.bend_shift));
  for (std::size_t i = 0; i < moved_a_s.size(); ++i) {
    result.moved_s[i] =
        w * result.moved_s[i] + (1 - w) * (moved_a_s[i] - paired.moved_s[i] / a.slope);
  }
  return result;
}

// How the three go together, by how far each line moved them: the two transitions share the lines,
// and with them each line's own lag.
Covariance ScatterOfTheLines(const TransitionCrossings& crossings,
                             const std::vector<double>& moved_a_s,
                             const std::vector<double>& moved_d_s,
                             const std::vector<double>& moved_early_s) {
  const std::size_t count = moved_a_s.size();
  Covariance covariance{};
  for (std::size_t i = 0; i < count; ++i) {
    const std::array<double, 3> line{moved_a_s[i], moved_d_s[i], moved_early_s[i] - moved_a_s[i]};
    for (std::size_t j = 0; j < 3; ++j) {
      for (std::size_t k = 0; k < 3; ++k) covariance[j][k] += line[j] * line[k];
    }
  }
  // Each fit's own error knows how much of the scatter the fit took out.
  const auto scale = [](double sigma, double variance) {
    return variance > 0 ? sigma / std::sqrt(variance) : 1;
  };
  const double n = static_cast<double>(count);
  const double fitted = std::sqrt(n / std::max(1.0, n - 3));
  const std::array<double, 3> scales{
      scale(crossings.acceleration.zero_sigma, covariance[0][0]),
      crossings.paired ? fitted : scale(crossings.deceleration.zero_sigma, covariance[1][1]),
      fitted};
  for (std::size_t j = 0; j < 3; ++j) {
    for (std::size_t k = 0; k < 3; ++k) covariance[j][k] *= scales[j] * scales[k];
  }
  return covariance;
}

}  // namespace

CrossingPair CorrectCrossings(const Transitions& transitions, const TransitionCrossings& crossings,
                              bool slope_has_scale, const ResponseOptions& options) {
  const signal::ZeroCrossing& a = crossings.acceleration;
  const signal::ZeroCrossing& d = crossings.deceleration;
  const std::vector<double> moved_a_s = MovedBy(transitions.acceleration, a);
  const Deceleration whole =
      WeighDeceleration(crossings, moved_a_s, MovedBy(transitions.deceleration, d));
  const Covariance lines = ScatterOfTheLines(
      crossings, moved_a_s, whole.moved_s,
      crossings.early ? MovedBy(*transitions.early, *crossings.early) : moved_a_s);

  const double prior = crossings.early ? Square(options.tail_sigma * a.zero) : 0;
  const double seen = prior > 0 ? prior / (prior + lines[2][2]) : 0;
  const double share = options.tail_share * seen;
  CrossingPair pair;
  pair.tail_s = seen * crossings.tail_s();
  const double unseen_tail_s = options.tail_share * std::sqrt((1 - seen) * (1 - seen) * prior);

  // Slip moves the tail too, and with it what is taken off both crossings.
  const double slip_a_s = transitions.acceleration.slip_excess_s / a.slope;
  const double slip_d_s = transitions.deceleration.slip_excess_s / whole.slope;
  const double moved_s =
      crossings.early
          ? share * (slip_a_s - transitions.early->slip_excess_s / crossings.early->slope)
          : 0;

  // What the window's end cuts off is not unread.
  const bool drains = transitions.ramp_s > 0 && a.zero > 0;
  const double full_slope =
      drains ? std::min(options.full_slope,
                        GainOfALinearLag(a.zero, transitions.ramp_s, transitions.drain_s))
             : options.full_slope;

  const auto correct = [&](const signal::ZeroCrossing& fit, double zero_s, double form,
                           std::size_t j, double slip_s) {
    CorrectedCrossing corrected;
    corrected.zero_s = zero_s - share * crossings.tail_s();
    corrected.variance = lines[j][j] + form - 2 * share * lines[j][2] + share * share * lines[2][2];
    corrected.common.slip = options.slip_sigma * slip_s;
    const double missing = slope_has_scale ? std::max(0.0, full_slope - fit.slope) : 0;
    corrected.common.unread = options.unread_sigma * std::min(1.0, missing) * std::abs(fit.zero);
    const double outside = slope_has_scale ? std::clamp(1 - fit.slope, 0.0, 1.0) : 0;
    const bool short_end = drains && transitions.slow_drain_s < options.paired.least_drain * a.zero;
    const double law = std::max(short_end ? options.short_end_sigma : options.lag_form_sigma,
                                options.lag_tail_sigma * outside) *
                       std::abs(fit.zero);
    corrected.common.form = std::hypot(law, options.tail_share_sigma * pair.tail_s, unseen_tail_s);
    return corrected;
  };
  const auto beyond = [&](const TransitionSeries& series, double zero_s) {
    return Square(options.beyond_sigma * series.Beyond_s(zero_s));
  };
  pair.acceleration =
      correct(a, a.zero, Square(a.bend_shift) + beyond(transitions.acceleration, a.zero), 0,
              slip_a_s + moved_s);
  pair.deceleration =
      correct(d, whole.zero_s, whole.form + beyond(transitions.deceleration, d.zero), 1,
              slip_d_s - moved_s);
  pair.covariance = lines[0][1] + (1 - whole.own) * Square(a.bend_shift) -
                    share * (lines[0][2] + lines[1][2]) + share * share * lines[2][2];
  return pair;
}

}  // namespace trammel::pressure_advance
