// Fits a straight line to points with many outliers.
#pragma once

#include <span>
#include <vector>

namespace trammel::geometry {

/// y = offset + slope · x.
struct RobustLine {
  double offset = 0;
  double slope = 0;
  double median_residual = 0;  ///< median of |y - line| over all points

  [[nodiscard]] double at(double x) const { return offset + slope * x; }
};

/// Fits by least median of squares (Rousseeuw 1984) over pairs of evenly chosen points: robust
/// against up to half outliers. Deterministic.
/// @param x, y  the same length, at least 2; x not all equal, non-decreasing.
/// @param scratch  reused.
/// Cost: about 300 candidate lines, each tried on at most 256 points.
[[nodiscard]] RobustLine FitRobustLine(std::span<const double> x, std::span<const double> y,
                                       std::vector<double>& scratch);

}  // namespace trammel::geometry
