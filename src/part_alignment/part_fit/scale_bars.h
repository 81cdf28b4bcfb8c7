// Scale bars against the shape of a measurement that was adjusted without them.
#pragma once

#include <Eigen/Core>
#include <string>
#include <vector>

#include "part_alignment/part_fit/part_fit.h"

namespace trammel::part_alignment {

/// The lengths of bars in a measurement of free scale: each bar's misclosure is that of the others.
struct FoundBars {
  std::vector<ScaleBar> bars;
  Eigen::VectorXd lengths;     ///< between the bars' ends, in any one unit
  Eigen::MatrixXd covariance;  ///< of these, each divided by its own: dimensionless
};

struct BarTest {
  bool used = false;
  /// Found by the scale of the other used bars, less calibrated. 0 where there are none.
  double misclosure_mm = 0;
  double test = 0;  ///< the misclosure in its standard deviations
  /// The least error of its length that the test finds, at 0.1 % false alarms and a power of 80 %
  /// (Baarda). 0: no other bar checks it.
  double detectable_mm = 0;
};

struct BarScale {
  double scale = 1;  ///< mm per unit of the lengths
  double sigma = 0;
  std::vector<BarTest> bars;         ///< as FoundBars::bars
  std::string fault;                 ///< bars that cannot all be right; empty without
  std::string unchecked;             ///< what nothing checks; empty where bars check one another
  std::vector<std::string> notices;  ///< of the bar that is left out
};

/// The scale by generalised least squares. Ratios of bars are tested (Baarda's w-test): one bar is
/// left out if it is the only one without which all others agree; any other contradiction is a
/// fault that names the worst. REQUIRES bars or their ends known to no less than 0.
[[nodiscard]] BarScale TestBars(const FoundBars& found);

}  // namespace trammel::part_alignment
