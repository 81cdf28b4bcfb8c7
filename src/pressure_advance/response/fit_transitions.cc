#include "pressure_advance/response/fit_transitions.h"

#include <utility>

namespace trammel::pressure_advance {

std::optional<TransitionCrossings> FitTransitions(const TransitionSeries& acceleration,
                                                  const TransitionSeries& deceleration,
                                                  const ResponseOptions& options) {
  const auto fit = [](const TransitionSeries& series, const signal::ZeroCrossingOptions& form) {
    return signal::FitZeroCrossing(series.pa_s, series.excess_s, series.sigma_s, form);
  };
  auto first = fit(acceleration, options.acceleration);
  auto second = fit(deceleration, options.deceleration);
  if (!first || !second) return std::nullopt;
  return TransitionCrossings{*std::move(first), *std::move(second)};
}

}  // namespace trammel::pressure_advance
