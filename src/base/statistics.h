// Robust and classical statistics of plain samples.
#pragma once

#include <span>
#include <vector>

namespace trammel {

/// Half-width of the 95 % interval of a normal distribution, in standard uncertainties.
inline constexpr double kNormal95 = 1.959964;

/// Returns the median; for even counts the mean of the middle two. REQUIRES a non-empty sample.
[[nodiscard]] double Median(std::span<const double> sample);

/// Returns the median of the slopes between all pairs of points (Theil 1950, Sen 1968); points that
/// are not finite, and pairs at the same x, do not count. 0 without any. REQUIRES equal lengths.
[[nodiscard]] double MedianSlope(std::span<const double> x, std::span<const double> y);

/// Returns the standard deviation estimated from the median absolute deviation (factor 1.4826:
/// consistent for a normal distribution). 0 for fewer than two values.
[[nodiscard]] double RobustStandardDeviation(std::span<const double> sample);

[[nodiscard]] double Mean(std::span<const double> sample);

/// Computes the deviation with n - 1 in the denominator; 0 for fewer than two values.
[[nodiscard]] double StandardDeviation(std::span<const double> sample);

/// Returns the quantile by linear interpolation between order statistics. REQUIRES 0 <= probability
/// <= 1.
[[nodiscard]] double Quantile(std::span<const double> sample, double probability);

/// Returns ln |Γ(x)|. std::lgamma also writes the sign to a variable that all threads share.
[[nodiscard]] double LogGamma(double x);

/// Returns the magnitude that |t| of Student's distribution exceeds with this probability.
/// REQUIRES 0 < probability < 1, freedom > 0 (need not be whole: Welch-Satterthwaite).
[[nodiscard]] double StudentPoint(double probability, double freedom);

/// Returns the two-sided 95 % point of Student's t. REQUIRES degrees_of_freedom > 0.
[[nodiscard]] double StudentT95(double degrees_of_freedom);

/// Returns the probability that chi-square with `freedom` degrees exceeds the value; 1 for a value
/// <= 0 or without a degree of freedom.
[[nodiscard]] double ChiSquareTail(double value, int freedom);

/// Returns the value below which chi-square is with this probability. REQUIRES 0 < probability < 1
/// and freedom > 0.
[[nodiscard]] double ChiSquareQuantile(double probability, int freedom);

}  // namespace trammel
