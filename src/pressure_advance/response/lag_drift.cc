#include "pressure_advance/response/lag_drift.h"

#include <algorithm>
#include <cmath>

namespace trammel::pressure_advance {

double GainOfALinearLag(double lag_s, double ramp_s, double drain_s) {
  return 1 + lag_s / ramp_s * std::expm1(-ramp_s / lag_s) * std::exp(-drain_s / lag_s);
}

LagDrift EstimateLagDrift(double slope, double slope_sigma, double linear_gain, double tail,
                          const LagDriftOptions& options) {
  const double thinning = std::clamp(tail / options.thinning_tail, 0.0, 1.0);
  const double least = linear_gain;
  const double greatest = linear_gain + thinning * (1 - linear_gain);
  const double low = 1 - slope / least;
  const double high = 1 - slope / greatest;
  const double reading = std::hypot((high - low) / std::sqrt(12.0), slope_sigma / least);
  const double prior = options.prior_sigma * options.prior_sigma;
  const double total = prior + reading * reading;
  return {prior / total * (low + high) / 2, reading * std::sqrt(prior / total)};
}

}  // namespace trammel::pressure_advance
