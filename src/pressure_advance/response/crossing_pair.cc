#include "pressure_advance/response/crossing_pair.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <vector>

#include "base/statistics.h"
#include "pressure_advance/response/lag_drift.h"

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

Transitions Without(Transitions transitions, std::size_t left_out) {
  transitions.acceleration = Without(std::move(transitions.acceleration), left_out);
  transitions.deceleration = Without(std::move(transitions.deceleration), left_out);
  if (transitions.early) transitions.early = Without(*std::move(transitions.early), left_out);
  return transitions;
}

// Covariance of acceleration, deceleration and tail, in this order; s^2.
using Covariance = std::array<std::array<double, 3>, 3>;

Covariance Jackknife(const Transitions& transitions, const ResponseOptions& options) {
  std::array<std::vector<double>, 3> values;
  for (std::size_t i = 0; i < transitions.acceleration.pa_s.size(); ++i) {
    const auto fit = FitTransitions(Without(transitions, i), options);
    if (!fit) continue;
    values[0].push_back(fit->acceleration.zero);
    values[1].push_back(fit->deceleration.zero);
    values[2].push_back(fit->tail_s());
  }
  Covariance covariance{};
  const std::size_t count = values[0].size();
  if (count < 2) return covariance;
  const double factor = (static_cast<double>(count) - 1) / static_cast<double>(count);
  const std::array<double, 3> mean{Mean(values[0]), Mean(values[1]), Mean(values[2])};
  for (std::size_t j = 0; j < 3; ++j) {
    for (std::size_t k = 0; k < 3; ++k) {
      for (std::size_t i = 0; i < count; ++i) {
        covariance[j][k] += factor * (values[j][i] - mean[j]) * (values[k][i] - mean[k]);
      }
    }
  }
  return covariance;
}

// A jackknife over few lines is itself uncertain, and can come out far too small by chance: the
// fit's own standard error is its floor.
double Floor(const signal::ZeroCrossing& fit) {
  const double plain = fit.residual_scale / std::max(std::abs(fit.slope), 1e-12);
  return plain * plain / std::max(1.0, fit.points);
}

}  // namespace

CrossingPair CorrectCrossings(const Transitions& transitions, const TransitionCrossings& crossings,
                              bool slope_has_scale, const ResponseOptions& options) {
  const signal::ZeroCrossing& a = crossings.acceleration;
  const signal::ZeroCrossing& d = crossings.deceleration;
  const Covariance lines = Jackknife(transitions, options);

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
    corrected.variance =
        std::max(lines[j][j] - 2 * share * lines[j][2] + share * share * lines[2][2], Floor(fit));
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
