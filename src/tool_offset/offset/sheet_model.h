// Model of all structures of a sheet: offsets of the tools, backlash of the axes, bias of the
// method.
#pragma once

#include <Eigen/Core>
#include <map>
#include <memory>
#include <optional>
#include <utility>
#include <vector>

#include "base/measured.h"
#include "tool_offset/reading/sheet_result.h"

namespace trammel::tool_offset {

/// Least squares of equations that need not determine every unknown.
struct WeightedFit {
  Eigen::VectorXd unknowns;
  Eigen::MatrixXd influence;   ///< of each equation on each unknown
  Eigen::MatrixXd unknowable;  ///< directions that no equation determines, one per column
  double chi_square = 0;
  int freedom = 0;
};
/// @param variance  of each equation's value, > 0.
[[nodiscard]] WeightedFit FitWeighted(const Eigen::MatrixXd& design, const Eigen::VectorXd& y,
                                      const Eigen::VectorXd& variance);

/// Weighted sum of the sheet's unknowns, in mm. Weights in the sheet's or the bed's axes, as named.
struct Combination {
  std::map<int, SheetPoint> tool;                     ///< weight of a tool's offset, sheet axes
  std::map<std::pair<int, int>, SheetPoint> pick_up;  ///< of (tool, pick-up), sheet axes
  /// Weights on a photo. u_mm: height of a tool's lines above the reference tool's. v_mm: their
  /// colour's outward shift in the picture's corner, per px.
  std::map<int, SheetPoint> radial;
  SheetPoint backlash;  ///< of the play along x (u_mm) and y (v_mm)
  /// Weights of the method's bias along u (u_mm) and v (v_mm), for legs drawn + and drawn -.
  std::array<SheetPoint, 2> bias;
};

/// Returns the equation of a structure's offset, without its programmed one:
///   o = (offset of comb 1's tool - offset of comb 0's tool + backlash of 1 - backlash of 0) along
///   its axis
///       + bias of that axis.
/// On an original sheet backlash cancels within each finger, and a bias belongs to "+" or to "-"
/// structures. An effect of a comb's order changes its sign from one to the other, an effect of its
/// side does not. While an axis moves up the nozzle is half of its backlash behind, down half
/// ahead. A leg along u or v of the tilted sheet moves both axes.
[[nodiscard]] Combination StructureEquation(const SheetPlan& plan, const Structure& structure);

/// Returns a structure's equation as it was read: on a photo with the effect of height and colour.
[[nodiscard]] Combination ReadingEquation(const SheetPlan& plan, const StructureReading& reading);

/// Returns the nozzle's lag while a leg of a comb is drawn, along the structure's axis. Per mm of
/// backlash along x (u_mm) and y (v_mm).
[[nodiscard]] SheetPoint BacklashAlong(const SheetPlan& plan, const Structure& structure,
                                       const Leg& leg);

/// Returns the programmed offset of comb 1 from comb 0, along the measured axis.
[[nodiscard]] double Programmed_mm(const Structure& structure);

/// Least squares over all readable structures, weighted by the scatter of their fingers, pooled by
/// tool.
///
/// The bias is one per axis. If the controls show that it differs between + and - legs (chi-square,
/// 0.1 %), it is one per direction, which costs precision; so it always is on original sheets with
/// a control, whose tested combs never change sides. If the structures contradict each other beyond
/// their scatter (chi-square, 1 %), all uncertainties grow by the square root of the ratio.
///
/// On a photo lines of another height or colour appear in another scale about the lens's foot point
/// or the picture's middle. Both are unknowns of each tool, estimated from how its structures'
/// offsets differ and grow along them, with a prior (RadialSpread). The prior's size follows from
/// the stated values, as a scaled inverse chi-square of so many degrees of freedom, and from the
/// lines, so lines more unlike than stated widen the intervals. The uncertainty includes what the
/// photo does not determine. Several photos of one print show the same ink, heights and colours
/// from other places: differences between a structure's readings depend on those alone.
class SheetModel {
 public:
  SheetModel(const SheetPlan& plan, const std::vector<StructureReading>& structures,
             const RadialSpread& spread = {});
  /// @param photos  of one print, each with all structures in the plan's order; at least one.
  SheetModel(const SheetPlan& plan, const std::vector<const std::vector<StructureReading>*>& photos,
             const RadialSpread& spread);
  ~SheetModel();

  /// Returns the combination's value; absent if the readable structures do not determine it.
  [[nodiscard]] std::optional<Quantity> Estimate(const Combination& combination) const;
  /// Returns the offset of a structure outside the model (self-test) without the method's bias.
  [[nodiscard]] std::optional<Quantity> WithoutBias(const SheetPlan& plan,
                                                    const StructureReading& reading) const;

  /// Returns the spread of tools' lines on a photo, in parts of the stated one; 1 on a scan.
  [[nodiscard]] double line_spread() const;
  [[nodiscard]] double chi_square() const;
  [[nodiscard]] int freedom() const;
  [[nodiscard]] bool bias_by_direction() const;
  [[nodiscard]] bool widened() const;
  [[nodiscard]] double pooled_scatter_mm() const;  ///< per finger

 private:
  struct Solution;
  std::unique_ptr<Solution> solution_;
};

}  // namespace trammel::tool_offset
