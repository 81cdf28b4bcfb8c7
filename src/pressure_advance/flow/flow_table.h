// Pressure advance over flow and acceleration: what several calibrations of one filament say
// together.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "base/measured.h"
#include "base/result.h"
#include "pressure_advance/flow/advance_law.h"

namespace trammel::pressure_advance {

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
