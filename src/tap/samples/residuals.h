// What a fit leaves over: outliers, mains hum and correlation, which a sum of squares does not
// know.
#pragma once

#include <array>
#include <cstddef>
#include <span>

namespace trammel::tap {

/// Of residuals, all of one fit.
struct ResidualTraits {
  /// The noise, whatever the outliers: median of |r| / 0.6745, but at least three quarters of the
  /// root mean square, below which only the steps of a coarse converter bring the median.
  double robust_deviation = 0;
  double largest = 0;  ///< Greatest |r|.
  /// n sum of rho_k^2 over the first lags: chi-squared with as many degrees of freedom for white
  /// noise (Box & Pierce 1970).
  double portmanteau = 0;
  /// Variance in the press over that of all residuals.
  double press_ratio = 1;
  /// ln of the variance in the press over that beyond the break, in its standard deviations for
  /// equal noise.
  double press_excess = 0;
  /// By which correlation in the press raises the variance of means, 1 + 2 sum of rho_k over the
  /// first lags that are significant (Bartlett 1946; Geyer 1992, section 3.3); >= 1.
  double press_correlation = 1;

  /// The same of all residuals.
  double correlation = 1;

  /// Nothing but noise, as far as this shows.
  [[nodiscard]] bool White() const;
  /// The factor on the noise variance, >= 1, for what is correlated; where the residuals are not
  /// white, the press's own, with the misfit that they hold, are the scale of the interval.
  [[nodiscard]] double Inflation() const;
};

inline constexpr int kLags = 8;
/// Exceeded by white noise in one tap of 200.
inline constexpr double kPortmanteauLimit = 22;

/// @param below    How many of them, the first, lie in the press.
/// @param scratch  As long as r.
[[nodiscard]] ResidualTraits Examine(std::span<const double> r, std::size_t below,
                                     std::span<double> scratch);

/// Weights that forget samples that stand alone: 1 up to 3 deviations, falling smoothly to 0 at 6
/// (Hampel's idea with Tukey's biweight for the slope). Where a neighbour is as far off, the press
/// has another form, or the noise is not white: no outlier.
/// @returns how many were given less than half.
std::size_t WeighOutliers(std::span<const double> r, double deviation, std::span<double> weight);

/// Mains hum at 50 or 60 Hz with its second and third harmonic, as sampled (aliases included).
struct MainsHum {
  static constexpr std::size_t kLines = 3;
  double frequency_hz = 0;             ///< 0 where there is none.
  double amplitude_g = 0;              ///< Of the strongest of its lines.
  std::array<bool, kLines> present{};  ///< Which of the harmonics stand out.
};

/// @param deviation  Of the noise as it stands, hum included.
[[nodiscard]] MainsHum FindMainsHum(std::span<const double> time_s, std::span<const double> r,
                                    double deviation);

/// Subtracts what the residuals hold of these lines from them and from the force. A fit has taken
/// up a part of the hum, so that fitting and removing are repeated once.
void RemoveMainsHum(const MainsHum& hum, std::span<const double> time_s, std::span<double> r,
                    std::span<double> force);

}  // namespace trammel::tap
