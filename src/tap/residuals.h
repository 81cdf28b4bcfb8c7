// What a fit leaves over: outliers, mains hum and correlation, which a sum of squares does not
// know.
#pragma once

#include <array>
#include <cstddef>
#include <span>

namespace trammel::tap {

/// Of residuals, all of one fit.
struct ResidualTraits {
  double median_deviation = 0;  ///< Median of |r| / 0.6745: the noise, whatever the outliers.
  double largest = 0;           ///< Greatest |r|.
  /// By which correlation raises the variance of means, 1 + 2 sum of rho_k over the first lags that
  /// are significant (Bartlett 1946; Geyer 1992, section 3.3); >= 1.
  double inflation = 1;
  /// n sum of rho_k^2 over the first lags: chi-squared with as many degrees of freedom for white
  /// noise (Box & Pierce 1970).
  double portmanteau = 0;
};

inline constexpr int kLags = 8;
/// Exceeded by white noise in one tap of 200.
inline constexpr double kPortmanteauLimit = 22;

/// @param scratch  As long as r.
[[nodiscard]] ResidualTraits Examine(std::span<const double> r, std::span<double> scratch);

/// Weights that leave residuals of ordinary noise alone and forget outliers: 1 up to 3 deviations,
/// falling smoothly to 0 at 6 (Hampel's idea with Tukey's biweight for the slope).
void WeighOutliers(std::span<const double> r, double deviation, std::span<double> weight);

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
