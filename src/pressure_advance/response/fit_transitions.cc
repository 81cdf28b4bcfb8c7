#include "pressure_advance/response/fit_transitions.h"

#include <cstddef>
#include <utility>

namespace trammel::pressure_advance {
namespace {

// Residuals of y about a fit, as errors in pressure advance; s. An outlier's counts nothing.
std::vector<double> Residuals(const TransitionSeries& series, const signal::ZeroCrossing& fit) {
  std::vector<double> residual_s(series.pa_s.size(), 0.0);
  if (!(fit.slope > 0)) return residual_s;
  for (std::size_t i = 0; i < residual_s.size(); ++i) {
    const double residual = series.excess_s[i] - signal::ResponseAt(fit, series.pa_s[i]);
    residual_s[i] = fit.weight[i] * residual / fit.slope;
  }
  return residual_s;
}

}  // namespace

std::optional<TransitionCrossings> FitTransitions(const TransitionSeries& acceleration,
                                                  const TransitionSeries& deceleration,
                                                  const ResponseOptions& options) {
  const auto fit = [](const TransitionSeries& series, const std::vector<double>& pa_s,
                      const signal::ZeroCrossingOptions& form) {
    return signal::FitZeroCrossing(pa_s, series.excess_s, series.sigma_s, form);
  };
  auto first = fit(acceleration, acceleration.pa_s, options.acceleration);
  auto second = fit(deceleration, deceleration.pa_s, options.deceleration);
  if (!first || !second) return std::nullopt;
  const std::vector<double> own_lag_s = Residuals(acceleration, *first);
  for (const double part : {0.5, 1.0}) {
    std::vector<double> pa_s = deceleration.pa_s;
    for (std::size_t i = 0; i < pa_s.size(); ++i) pa_s[i] -= part * own_lag_s[i];
    auto joint = fit(deceleration, pa_s, options.deceleration);
    if (joint && joint->residual_scale < second->residual_scale) second = std::move(joint);
  }
  return TransitionCrossings{*std::move(first), *std::move(second)};
}

}  // namespace trammel::pressure_advance
