// The edge's profile: the normal distribution and its integral.
#pragma once

#include <cmath>

namespace trammel::part_alignment {

[[nodiscard]] inline double NormalDensity(double t) {
  return 0.3989422804014327 * std::exp(-0.5 * t * t);
}

/// The normal distribution's integral from its density, to 7.5e-8 (Abramowitz & Stegun 26.2.17).
/// @param density  NormalDensity(t)
[[nodiscard]] inline double NormalIntegral(double t, double density) {
  const double k = 1 / (1 + 0.2316419 * std::abs(t));
  const double tail =
      density * k *
      (0.319381530 + k * (-0.356563782 + k * (1.781477937 + k * (-1.821255978 + k * 1.330274429))));
  return t > 0 ? 1 - tail : tail;
}

[[nodiscard]] inline double NormalIntegral(double t) { return NormalIntegral(t, NormalDensity(t)); }

}  // namespace trammel::part_alignment
