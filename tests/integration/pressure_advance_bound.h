// What no method does better than on the paper's pattern (docs/pressure-advance.md).
#pragma once

#include <Eigen/Core>

#include "sim/print/printer_traits.h"

namespace trammel::test {

inline constexpr int kBoundLines = 10;
inline constexpr double kBendSigma = 0.0064;  ///< of what tail and slip do not tell: 60 prints
inline constexpr double kSlipSigma = 0.2887;  ///< of a slip evenly over its range: 1 / sqrt(12)

/// What has to be learnt of the same lines.
struct Learnt {
  double crossing_s = 0;
  double slope = 1;
  double bend = 0;
  double slip = 0;  ///< less its mean, over the most that is drawn (2 % at 15 mm^3/s)
};

[[nodiscard]] double TestedPa(int line);

/// One line's two excesses, s; beyond the crossing the acceleration's alone, as a gap's filament
/// may be lost.
/// @param gradient  filled: how they change with what is learnt, in the order of its fields
[[nodiscard]] Eigen::VectorXd Expected(const Learnt& learnt, double pa_s,
                                       Eigen::MatrixXd& gradient);

/// Of one line's two excesses, s^2: its own lag, its flow, and its level.
[[nodiscard]] Eigen::Matrix2d CovarianceOf(const sim::PrinterTraits& traits);

/// Information on slip and bend of one who draws these printers.
[[nodiscard]] Eigen::Matrix4d KnownBeforehand();

/// The least rms error, s.
[[nodiscard]] double BoundOf(const sim::PrinterTraits& traits);

/// The same if the mean of the lines' lags were to be found and nothing else were to be learnt, s.
[[nodiscard]] double MeanBoundOf(const sim::PrinterTraits& traits);

}  // namespace trammel::test
