// Combines calibrations at several speeds into a table of pressure advance over flow.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "base/measured.h"
#include "base/result.h"

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

/// One calibration, or several under the same conditions.
struct FlowPoint {
  double flow_mm3_s = 0;          ///< of the fast stretch, > 0
  double slow_flow_mm3_s = 0;     ///< of the slow stretches, >= 0
  double acceleration_mm_s2 = 0;  ///< > 0
  Quantity pressure_advance_s;
  int count = 1;  ///< of calibrations
};

/// What flow or acceleration makes of the value.
struct FlowTrend {
  Measured per_unit;         ///< s per mm³/s, or s for each doubling of the acceleration
  bool significant = false;  ///< its 95 % interval leaves out 0
};

struct FlowTable {
  std::vector<FlowPoint> rows;  ///< by acceleration, then flow; no two under the same conditions
  /// For a printer that takes one value: the mean of the rows. Its uncertainty is theirs in the
  /// mean, as if they erred alike; what it leaves wrong under the single conditions is
  /// `greatest_miss_s`.
  Quantity single_s;
  double greatest_miss_s = 0;  ///< of a row's value from `single_s`
  FlowTrend over_flow;
  FlowTrend over_acceleration;
  /// How the value goes with flow: of all rows, or of one acceleration's where that matters, too.
  AdvanceLaws laws;
  std::optional<double> laws_acceleration_mm_s2;  ///< that one
  std::vector<std::string> notices;
};

/// Combines points under the same conditions (within 2 %; means by their uncertainties, which grow
/// where they scatter more than they state) and fits how the value changes: one slope over flow for
/// all accelerations, one over the logarithm of acceleration for all flows; and a law of flow
/// (FitAdvanceLaws).
/// Errors (kInput): no point; a flow or acceleration that is no positive number.
[[nodiscard]] Result<FlowTable> MakeFlowTable(std::vector<FlowPoint> points);

/// Rows that OrcaSlicer's adaptive pressure advance keeps: those of accelerations with two flows at
/// least.
[[nodiscard]] std::vector<FlowPoint> AdaptiveRows(const FlowTable& table);

}  // namespace trammel::pressure_advance
