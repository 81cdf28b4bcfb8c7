// Combines calibrations at several speeds into a table of pressure advance over flow.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "base/measured.h"
#include "base/result.h"

namespace trammel::pressure_advance {

/// Form of A(q), the filament stored at a steady flow q.
enum class AdvanceForm {
  kPower,       ///< offset · q^shape: shear thinning, in the units of mm³ and s
  kTanh,        ///< linear · q + offset · tanh(q / shape)
  kReciprocal,  ///< linear · q + offset · (1 - 1 / (1 + q / shape))
};

struct AdvanceModel {
  AdvanceForm form = AdvanceForm::kPower;
  double linear_s = 0;    ///< >= 0; 0 of kPower
  double offset_mm3 = 0;  ///< >= 0
  double shape = 1;       ///< exponent of kPower; else the knee, mm³/s
  Interval shape95;       ///< shapes that fit as well, within those that were tried
};

/// Value measured between two flows, with its uncertainty.
struct AdvanceValue {
  double slow_mm3_s = 0;  ///< >= 0
  double fast_mm3_s = 0;  ///< > slow_mm3_s
  double value_s = 0;
  double sigma_s = 0;  ///< > 0
};

struct AdvanceModels {
  /// Exponent of the power law. 1: the lag is the same at all flows, one value is right everywhere.
  Measured exponent;
  bool bends = false;  ///< the exponent's 95 % interval leaves out 1
  /// Better of the two forms that firmware supports; present if at least three flows were measured
  /// and the law is curved.
  std::optional<AdvanceModel> firmware;
  double greatest_miss_s = 0;  ///< maximum error of `firmware` between its flows
};

/// Fits by weighted least squares for each of many shapes. The interval contains those whose
/// chi-square is within 1.96² of the minimum, more if values scatter beyond their sigmas.
/// Verdicts of the exponent: cannot_tell with fewer than two flows (1.1 times apart at least), or
/// if any exponent fits equally well.
[[nodiscard]] AdvanceModels FitAdvanceModels(const std::vector<AdvanceValue>& values);

/// One calibration, or several under the same conditions.
struct FlowPoint {
  double flow_mm3_s = 0;                  ///< of the fast segment, > 0
  double slow_flow_mm3_s = 0;             ///< of the slow segments, >= 0
  double acceleration_mm_s2 = 0;          ///< > 0
  std::optional<double> layer_height_mm;  ///< of the lines, > 0; absent: not known
  Quantity pressure_advance_s;
  int count = 1;  ///< number of calibrations
};

/// Trend of the value over flow or acceleration.
struct FlowTrend {
  Measured per_unit;         ///< s per mm³/s, or s for each doubling of the acceleration
  bool significant = false;  ///< true if its 95 % interval excludes 0
};

struct FlowTable {
  /// By layer height, acceleration and flow; no two under the same conditions.
  std::vector<FlowPoint> rows;
  /// Mean of the rows, for a printer that takes one value. Its uncertainty is the mean of theirs,
  /// as for fully correlated errors; the largest error under single conditions is
  /// `greatest_miss_s`.
  Quantity single_s;
  double greatest_miss_s = 0;  ///< maximum row deviation from `single_s`
  FlowTrend over_flow;
  FlowTrend over_acceleration;
  /// Models of the value over flow: of all rows, or of one acceleration's if that or the layer
  /// height matters, too.
  AdvanceModels laws;
  std::optional<double> laws_acceleration_mm_s2;  ///< that acceleration
  std::optional<double> laws_layer_height_mm;     ///< that layer height, if rows have several
  std::vector<std::string> notices;
};

/// Combines points under the same conditions (within 2 %; means weighted by their uncertainties,
/// which grow if the points scatter more than stated). Fits the value's trend: one slope over flow
/// for all accelerations, one over the logarithm of acceleration for all flows; and a law of flow
/// (FitAdvanceModels). Compares only rows of one layer height; a notice names several.
/// Errors (kInput): no point; a flow, acceleration or layer height that is no positive number.
[[nodiscard]] Result<FlowTable> MakeFlowTable(std::vector<FlowPoint> points);

/// Returns each known layer height of the rows once, from the least.
[[nodiscard]] std::vector<double> LayerHeights_mm(const std::vector<FlowPoint>& rows);

/// Tells whether a row's layer height is this one, within what counts as the same conditions.
[[nodiscard]] bool IsOfLayerHeight(const FlowPoint& row, double layer_height_mm);

/// Returns the rows that OrcaSlicer's adaptive pressure advance accepts: those of accelerations
/// with at least two flows. Its model has no layer height: REQUIRES rows of one.
[[nodiscard]] std::vector<FlowPoint> AdaptiveRows(const FlowTable& table);

}  // namespace trammel::pressure_advance
