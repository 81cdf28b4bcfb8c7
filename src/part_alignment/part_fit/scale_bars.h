// Tests scale bars against the shape of a measurement that was adjusted without them.
#pragma once

#include <Eigen/Core>
#include <string>
#include <vector>

#include "part_alignment/part_fit/part_fit.h"

namespace trammel::part_alignment {

/// Lengths of bars in a measurement of free scale. The other bars determine each bar's misclosure.
struct FoundBars {
  std::vector<ScaleBar> bars;
  Eigen::VectorXd lengths;     ///< between the bars' ends, in any one unit
  Eigen::MatrixXd covariance;  ///< relative to each bar's variance: dimensionless
};

struct BarTest {
  bool used = false;
  /// Length by the scale of the other used bars, minus calibrated length. 0 if there are none.
  double misclosure_mm = 0;
  double test = 0;  ///< the misclosure in its standard deviations
  /// Minimum error of its length that the test detects, at 0.1 % false alarms and a power of 80 %
  /// (Baarda). 0: no other bar checks it.
  double detectable_mm = 0;
};

struct BarScale {
  double scale = 1;  ///< mm per unit of the lengths
  double sigma = 0;
  std::vector<BarTest> bars;         ///< like FoundBars::bars
  std::string fault;                 ///< bars that cannot all be right; empty without
  std::string unchecked;             ///< unchecked inputs; empty if bars check one another
  std::vector<std::string> notices;  ///< about the bar left out
};

/// Estimates the scale by generalised least squares. Tests ratios of bars (Baarda's w-test). Drops
/// a bar if it is the only one without which all others agree; any other contradiction is a fault
/// that names the worst. REQUIRES uncertainties of bars or their ends of at least 0.
[[nodiscard]] BarScale TestBars(const FoundBars& found);

}  // namespace trammel::part_alignment
