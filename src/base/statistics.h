// Robust and classical statistics of plain samples.
#pragma once

#include <span>
#include <vector>

namespace trammel {

/// Half of the 95 % interval of a normal distribution, in standard uncertainties.
inline constexpr double kNormal95 = 1.959964;

/// REQUIRES a non-empty sample. Even counts: the mean of the middle two.
[[nodiscard]] double Median(std::span<const double> sample);

/// Standard deviation from the median absolute deviation (factor 1.4826: consistent for a normal
/// distribution). 0 for fewer than two values.
[[nodiscard]] double RobustStandardDeviation(std::span<const double> sample);

[[nodiscard]] double Mean(std::span<const double> sample);

/// With n - 1 in the denominator; 0 for fewer than two values.
[[nodiscard]] double StandardDeviation(std::span<const double> sample);

/// Quantile by linear interpolation between order statistics. REQUIRES 0 <= probability <= 1.
[[nodiscard]] double Quantile(std::span<const double> sample, double probability);

/// ln |Γ(x)|. std::lgamma also writes the sign to a variable that all threads share.
[[nodiscard]] double LogGamma(double x);

/// The magnitude that |t| of Student's distribution exceeds with this probability.
/// REQUIRES 0 < probability < 1, freedom > 0 (need not be whole: Welch-Satterthwaite).
[[nodiscard]] double StudentPoint(double probability, double freedom);

/// The two-sided 95 % point of Student's t. REQUIRES degrees_of_freedom > 0.
[[nodiscard]] double StudentT95(double degrees_of_freedom);

/// Probability that chi-square with `freedom` degrees exceeds the value (of what is not above 0,
/// and without a degree of freedom: 1).
[[nodiscard]] double ChiSquareTail(double value, int freedom);

/// The value that chi-square stays below with this probability. REQUIRES 0 < probability < 1 and
/// freedom > 0.
[[nodiscard]] double ChiSquareQuantile(double probability, int freedom);

}  // namespace trammel
