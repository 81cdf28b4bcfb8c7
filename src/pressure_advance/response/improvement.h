// What a calibrated pressure advance changed: lines printed with it beside lines printed without.
#pragma once

#include <optional>
#include <span>
#include <vector>

#include "base/measured.h"
#include "pressure_advance/profile/line_motion.h"
#include "pressure_advance/profile/line_profile.h"
#include "pressure_advance/response/transitions.h"

namespace trammel::pressure_advance {

struct ImprovementOptions {
  TransitionOptions transitions;
  int fewest_lines = 3;  ///< of either kind: below it a scatter says nothing
  /// Largest half width of a 95 % interval: what is wider does not tell much from little.
  double widest_interval = 0.3;
  /// Smallest surplus of the control over its standard error: what is left is a part of it.
  double least_significance = 5;
};

/// Lines of either kind in one measurement.
struct ComparedGroup {
  double pressure_advance_s = 0;
  int lines = 0;                       ///< printed
  int used = 0;                        ///< of them measured
  std::optional<double> deviation_px;  ///< mean of their scores
};

struct Improvement {
  ComparedGroup control;  ///< the lower of the two values
  ComparedGroup calibrated;
  /// By how much of the control's mean deviation the calibrated lines' is lower: 1 would be a
  /// perfect surface, 0 no change, negative worse. Dimensionless. The paper's measure.
  Measured deviation;
  /// What is left of the control's surplus filament after a speed change, dimensionless: 0 is
  /// right, negative is overdone. Independent of anything that makes every line rough.
  Measured acceleration_left;
  Measured deceleration_left;
};

/// Compares the lines of the two values of pressure advance that a recording holds.
///
/// Uncertainty: the scatter of the lines about the mean of their kind, propagated to the ratio of
/// two means (first order), with Student's t and Welch's degrees of freedom. Lines of one print are
/// taken as independent of each other.
/// @param profiles  one per line.
/// @param score_px  the paper's score of each, same order; absent where a line has none.
/// @returns refused where there are not two values or too few usable lines of either, with the
/// first unusable line's own reason; cannot-tell where the interval is too wide or the control
/// shows too little.
[[nodiscard]] Improvement CompareWithControl(const std::vector<LineProfile>& profiles,
                                             std::span<const std::optional<double>> score_px,
                                             const LineMotion& motion,
                                             const ImprovementOptions& options = {});

}  // namespace trammel::pressure_advance
