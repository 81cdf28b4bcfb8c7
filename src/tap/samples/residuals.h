// Traits of a fit's residuals: outliers, mains hum and correlation, which a sum of squares does not
// show.
#pragma once

#include <array>
#include <cstddef>
#include <span>

namespace trammel::tap {

/// Traits of the residuals of one fit.
struct ResidualTraits {
  /// Noise without the outliers: median of |r| / 0.6745, but at least three quarters of the root
  /// mean square. Only the steps of a coarse converter bring the median below that.
  double robust_deviation = 0;
  double largest = 0;  ///< Greatest |r|.
  /// n sum of rho_k^2 over the first lags: chi-squared with as many degrees of freedom for white
  /// noise (Box & Pierce 1970).
  double portmanteau = 0;
  /// Ratio of the variance in the press to that of all residuals.
  double press_ratio = 1;
  /// ln of the ratio of the variance in the press to that beyond the break, in its standard
  /// deviations for equal noise.
  double press_surplus = 0;
  /// Variance factor of means by correlation in the press, >= 1. Estimate: 1 + 2 sum of rho_k over
  /// the first significant lags (Bartlett 1946; Geyer 1992, section 3.3).
  double press_correlation = 1;

  /// Factor of correlation in all residuals.
  double correlation = 1;

  /// True if the residuals show nothing but noise.
  [[nodiscard]] bool White() const;
  /// Returns the factor of correlation on the noise variance, >= 1. If the residuals are not white,
  /// the press's own, with their misfit, are the scale of the interval.
  [[nodiscard]] double Inflation() const;
};

inline constexpr int kLags = 8;
/// Limit that white noise exceeds in one tap of 200.
inline constexpr double kPortmanteauLimit = 22;

/// @param below    How many of them, the first, lie in the press.
/// @param scratch  As long as r.
[[nodiscard]] ResidualTraits Examine(std::span<const double> r, std::size_t below,
                                     std::span<double> scratch);

/// Computes weights that ignore lone outliers: 1 up to 3 deviations, falling smoothly to 0 at 6
/// (Hampel's idea with Tukey's biweight for the slope). If a neighbour is as far off, the press has
/// another form, or the noise is not white: no outlier.
/// @returns the number of weights below half.
std::size_t WeighOutliers(std::span<const double> r, double deviation, std::span<double> weight);

/// Mains hum at 50 or 60 Hz with its second and third harmonic, as sampled (aliases included).
struct MainsHum {
  static constexpr std::size_t kLines = 3;
  double frequency_hz = 0;             ///< 0 where there is none.
  double amplitude_g = 0;              ///< of the strongest line
  std::array<bool, kLines> present{};  ///< significant harmonics
};

/// @param deviation  Of the noise as it stands, hum included.
[[nodiscard]] MainsHum FindMainsHum(std::span<const double> time_s, std::span<const double> r,
                                    double deviation);

/// Subtracts these lines from the residuals and from the force. A fit has absorbed a part of the
/// hum, so fitting and removing are repeated once.
void RemoveMainsHum(const MainsHum& hum, std::span<const double> time_s, std::span<double> r,
                    std::span<double> force);

}  // namespace trammel::tap
