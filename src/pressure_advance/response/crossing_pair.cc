#include "pressure_advance/response/crossing_pair.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <vector>

#include "base/square.h"
#include "pressure_advance/response/lag_drift.h"

namespace trammel::pressure_advance {
namespace {

// Covariance of acceleration, deceleration and tail, in this order; s^2.
using Covariance = std::array<std::array<double, 3>, 3>;

// By how far each line's residuals moved the three. The two transitions share the lines, and with
// them each line's own lag.
Covariance ScatterOfTheLines(const Transitions& transitions, const TransitionCrossings& crossings) {
  const std::size_t count = transitions.acceleration.pa_s.size();
  const auto moved_s = [](const TransitionSeries& series, const signal::ZeroCrossing& fit,
                          std::size_t i) {
    return fit.influence[i] * (series.excess_s[i] - fit.fitted[i]);
  };
  Covariance covariance{};
  for (std::size_t i = 0; i < count; ++i) {
    const double a_s = moved_s(transitions.acceleration, crossings.acceleration, i);
    const double d_s = moved_s(transitions.deceleration, crossings.deceleration, i);
    const double early_s = crossings.early ? moved_s(*transitions.early, *crossings.early, i) : a_s;
    const std::array<double, 3> line{a_s, d_s, early_s - a_s};
    for (std::size_t j = 0; j < 3; ++j) {
      for (std::size_t k = 0; k < 3; ++k) covariance[j][k] += line[j] * line[k];
    }
  }
  // Each fit's own error knows how much of the scatter the fit took out.
  const auto scale = [](double sigma, double variance) {
    return variance > 0 ? sigma / std::sqrt(variance) : 1;
  };
  const double n = static_cast<double>(count);
  const std::array<double, 3> scales{scale(crossings.acceleration.zero_sigma, covariance[0][0]),
                                     scale(crossings.deceleration.zero_sigma, covariance[1][1]),
                                     std::sqrt(n / std::max(1.0, n - 3))};
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
  const Covariance lines = ScatterOfTheLines(transitions, crossings);

  const double prior = crossings.early ? Square(options.tail_sigma * a.zero) : 0;
  const double seen = prior > 0 ? prior / (prior + lines[2][2]) : 0;
  const double share = options.tail_share * seen;
  CrossingPair pair;
  pair.tail_s = seen * crossings.tail_s();
  const double unseen_tail_s = options.tail_share * std::sqrt((1 - seen) * (1 - seen) * prior);

  // Slip moves the tail too, and with it what is taken off both crossings.
  const double slip_a_s = transitions.acceleration.slip_excess_s / a.slope;
  const double slip_d_s = transitions.deceleration.slip_excess_s / d.slope;
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

  const auto correct = [&](const signal::ZeroCrossing& fit, std::size_t j, double slip_s) {
    CorrectedCrossing corrected;
    corrected.zero_s = fit.zero - share * crossings.tail_s();
    corrected.variance = Square(fit.zero_sigma) + Square(fit.bend_shift) - 2 * share * lines[j][2] +
                         share * share * lines[2][2];
    corrected.common.slip = options.slip_sigma * slip_s;
    const double missing = slope_has_scale ? std::max(0.0, full_slope - fit.slope) : 0;
    corrected.common.unread = options.unread_sigma * std::min(1.0, missing) * std::abs(fit.zero);
    const double outside = slope_has_scale ? std::clamp(1 - fit.slope, 0.0, 1.0) : 0;
    const double law =
        std::max(options.lag_form_sigma, options.lag_tail_sigma * outside) * std::abs(fit.zero);
    corrected.common.form = std::hypot(law, options.tail_share_sigma * pair.tail_s, unseen_tail_s);
    return corrected;
  };
  pair.acceleration = correct(a, 0, slip_a_s + moved_s);
  pair.deceleration = correct(d, 1, slip_d_s - moved_s);
  pair.covariance = lines[0][1] - share * (lines[0][2] + lines[1][2]) + share * share * lines[2][2];
  return pair;
}

}  // namespace trammel::pressure_advance
