// Compares lines printed with a pressure advance with lines printed without.
#pragma once

#include <optional>
#include <span>
#include <vector>

#include "base/measured.h"
#include "pressure_advance/profile/line_profile.h"

namespace trammel::pressure_advance {

/// Lines of one pressure advance in one measurement.
struct ComparedGroup {
  double pressure_advance_s = 0;
  int lines = 0;  ///< printed
  int used = 0;   ///< number measured
};

struct Improvement {
  ComparedGroup control;  ///< the lower of the two values
  ComparedGroup calibrated;
  /// Reduction of the mean deviation by calibration, relative to the control: 1 is a perfect
  /// surface, 0 no change, negative worse. Dimensionless. The paper's measure.
  Measured deviation;
  /// Share of the control's surplus filament that remains after the speed changes, their mean: 0 is
  /// right, negative is overcompensated. Independent of a roughness common to all lines.
  Measured surplus_left;
};

/// Compares the lines of the two values of pressure advance in a recording.
///
/// Uncertainty: the scatter of the lines about the mean of their group, propagated to the ratio of
/// two means (first order), with Student's t and Welch's degrees of freedom. Lines of one print are
/// assumed independent.
/// @param profiles  one per line.
/// @param score_px  the paper's score of each, same order; absent if a line has none.
/// @returns refused unless there are two values and at least three usable lines of each, with the
/// first unusable line's own reason; cannot-tell if the interval is wider than 30 % to either side,
/// or the control's surplus is below five standard errors.
[[nodiscard]] Improvement CompareWithControl(const std::vector<LineProfile>& profiles,
                                             std::span<const std::optional<double>> score_px,
                                             const LineMotion& motion);

}  // namespace trammel::pressure_advance
