#include "pressure_advance/response/fit_transitions.h"

#include <utility>

namespace trammel::pressure_advance {

std::optional<TransitionCrossings> FitTransitions(const Transitions& transitions,
                                                  const ResponseOptions& options) {
  const auto fit = [](const TransitionSeries& series, const signal::ZeroCrossingOptions& form) {
    return signal::FitZeroCrossing(series.pa_s, series.excess_s, series.sigma_s, form);
  };
  auto acceleration = fit(transitions.acceleration, options.acceleration);
  auto deceleration = fit(transitions.deceleration, options.deceleration);
  if (!acceleration || !deceleration) return std::nullopt;
  TransitionCrossings crossings{*std::move(acceleration), *std::move(deceleration), std::nullopt};
  if (transitions.early) crossings.early = fit(*transitions.early, options.acceleration);
  return crossings;
}

}  // namespace trammel::pressure_advance
