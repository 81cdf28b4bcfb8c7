// Advance over flow: the laws of firmware with non-linear pressure advance, fitted to values that
// were measured at several flows.
#pragma once

#include <optional>
#include <vector>

#include "base/measured.h"

namespace trammel::pressure_advance {

/// The filament that must be stored at a steady flow q, A(q).
enum class AdvanceForm {
  kPower,       ///< offset · q^shape: shear thinning, in the units of mm³ and s
  kTanh,        ///< linear · q + offset · tanh(q / shape)
  kReciprocal,  ///< linear · q + offset · (1 - 1 / (1 + q / shape))
};

struct AdvanceLaw {
  AdvanceForm form = AdvanceForm::kPower;
  double linear_s = 0;    ///< >= 0; 0 of kPower
  double offset_mm3 = 0;  ///< >= 0
  double shape = 1;       ///< exponent of kPower; else the knee, mm³/s
  Interval shape95;       ///< shapes that fit as well, within those that were tried
};

/// A value that was measured between two flows, and what it is known to.
struct AdvanceValue {
  double slow_mm3_s = 0;  ///< >= 0
  double fast_mm3_s = 0;  ///< > slow_mm3_s
  double value_s = 0;
  double sigma_s = 0;  ///< > 0
};

/// A(q) in mm³. REQUIRES flow_mm3_s >= 0.
[[nodiscard]] double AdvanceAt(const AdvanceLaw& law, double flow_mm3_s);

/// (A(fast) - A(slow)) / (fast - slow): the one pressure advance that stores just what this change
/// of flow needs, s. REQUIRES fast > slow >= 0.
[[nodiscard]] double PressureAdvanceBetween(const AdvanceLaw& law, double slow_mm3_s,
                                            double fast_mm3_s);

struct AdvanceLaws {
  /// Of the power law. 1: the lag is the same at all flows, one value is right everywhere.
  Measured exponent;
  bool bends = false;  ///< the exponent's 95 % interval leaves out 1
  /// The better of the two forms that firmware knows; present where three flows or more were
  /// measured and the law bends.
  std::optional<AdvanceLaw> firmware;
  double greatest_miss_s = 0;  ///< of a value from what `firmware` says between its flows
};

/// Weighted least squares for each of many shapes; the interval holds those whose chi-square is
/// within 1.96² of the least, more where values scatter beyond their sigmas.
/// Verdicts of the exponent: cannot_tell with fewer than two flows (1.1 times apart at least), or
/// where any exponent fits as well.
[[nodiscard]] AdvanceLaws FitAdvanceLaws(const std::vector<AdvanceValue>& values);

}  // namespace trammel::pressure_advance
