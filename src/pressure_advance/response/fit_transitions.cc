#include "pressure_advance/response/fit_transitions.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include "base/square.h"

namespace trammel::pressure_advance {
namespace {

std::optional<signal::ZeroCrossing> FitSeen(const TransitionSeries& series,
                                            const signal::ZeroCrossingOptions& form) {
  std::vector<std::size_t> seen;
  std::vector<double> pa_s, excess_s, sigma_s;
  for (std::size_t i = 0; i < series.pa_s.size(); ++i) {
    if (!std::isfinite(series.sigma_s[i])) continue;
    seen.push_back(i);
    pa_s.push_back(series.pa_s[i]);
    excess_s.push_back(series.excess_s[i]);
    sigma_s.push_back(series.sigma_s[i]);
  }
  auto fit = signal::FitZeroCrossing(pa_s, excess_s, sigma_s, form);
  if (!fit || seen.size() == series.pa_s.size()) return fit;
  const auto spread = [&](std::vector<double>& values) {
    std::vector<double> all(series.pa_s.size(), 0);
    for (std::size_t k = 0; k < seen.size(); ++k) all[seen[k]] = values[k];
    values = std::move(all);
  };
  spread(fit->weight);
  spread(fit->influence);
  fit->fitted.clear();
  for (const double pa : series.pa_s) fit->fitted.push_back(signal::ResponseAt(*fit, pa));
  return fit;
}

std::optional<PairedDifference> FitDifference(const Transitions& transitions,
                                              const TransitionCrossings& crossings,
                                              const ResponseOptions& options) {
  const TransitionSeries& a = transitions.acceleration;
  const TransitionSeries& d = transitions.deceleration;
  const signal::ZeroCrossing& zero = crossings.acceleration;
  if (!crossings.early || !(transitions.ramp_s > 0) || !(zero.slope > 0)) return std::nullopt;
  if (a.SeenPa_s().size() < a.pa_s.size() || d.SeenPa_s().size() < a.pa_s.size()) {
    return std::nullopt;
  }
  // What the deceleration's window cuts off would look like slip.
  if (transitions.slow_drain_s < options.paired.least_drain * zero.zero) return std::nullopt;
  // Early and whole window share the lines: half of the crossing's sigma is left of the tail's.
  const double prior = Square(options.tail_sigma * zero.zero);
  const double noise = Square(zero.zero_sigma / 2);
  const double tail_s =
      prior > 0 ? options.tail_share * crossings.tail_s() * prior / (prior + noise) : 0;
  return FitPairedDifference(a, d, zero.zero - tail_s, zero.slope,
                             a.slip_excess_s / (a.slip_excess_s + d.slip_excess_s), options.paired);
}

}  // namespace

std::vector<double> TransitionSeries::SeenPa_s() const {
  std::vector<double> seen;
  for (std::size_t i = 0; i < pa_s.size(); ++i) {
    if (std::isfinite(sigma_s[i])) seen.push_back(pa_s[i]);
  }
  return seen;
}

double TransitionSeries::Beyond_s(double zero_s) const {
  const std::vector<double> seen = SeenPa_s();
  if (seen.size() == pa_s.size() || seen.empty()) return 0;
  const auto [least, most] = std::minmax_element(seen.begin(), seen.end());
  return std::max({0.0, *least - zero_s, zero_s - *most});
}

std::optional<TransitionCrossings> FitTransitions(const Transitions& transitions,
                                                  const ResponseOptions& options) {
  auto acceleration = FitSeen(transitions.acceleration, options.acceleration);
  auto deceleration = FitSeen(transitions.deceleration, options.deceleration);
  if (!acceleration || !deceleration) return std::nullopt;
  TransitionCrossings crossings{*std::move(acceleration), *std::move(deceleration), std::nullopt,
                                std::nullopt};
  if (transitions.early) crossings.early = FitSeen(*transitions.early, options.acceleration);
  crossings.paired = FitDifference(transitions, crossings, options);
  return crossings;
}

}  // namespace trammel::pressure_advance
