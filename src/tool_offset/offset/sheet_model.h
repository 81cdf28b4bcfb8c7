// All structures of a sheet together: offsets of the tools, play of the axes, bias of the method.
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

/// A weighted sum of the sheet's unknowns, in mm. Weights in the sheet's or the bed's axes, as
/// named.
struct Combination {
  std::map<int, SheetPoint> tool;                     ///< of a tool's offset, sheet axes
  std::map<std::pair<int, int>, SheetPoint> pick_up;  ///< of (tool, pick-up), sheet axes
  /// Of a photo: of the height (u_mm) of a tool's lines above the reference tool's, and of how far
  /// their colour lies further out in the picture's corner (v_mm: per px).
  std::map<int, SheetPoint> radial;
  SheetPoint play;  ///< of the play along x (u_mm) and y (v_mm)
  /// Of the method's bias along u (u_mm) and v (v_mm), for legs drawn + and for legs drawn -.
  std::array<SheetPoint, 2> bias;
};

/// What a structure's offset is made of, but for its programmed one:
///   o = (offset of comb 1's tool - offset of comb 0's tool + play of 1 - play of 0) along its axis
///       + bias of that axis.
/// On an original sheet play cancels within each finger, and a bias belongs to "+" or to "-"
/// structures: what favours a comb's order changes its sign from one to the other, what favours its
/// side does not.
/// While an axis moves up the nozzle is half of its play behind, down half ahead; a leg along u or
/// v of the tilted sheet moves both axes.
[[nodiscard]] Combination StructureEquation(const SheetPlan& plan, const Structure& structure);

/// The same of a structure as it was read: on a photo with what height and colour do to it.
[[nodiscard]] Combination ReadingEquation(const SheetPlan& plan, const StructureReading& reading);

/// How the nozzle lags while a leg of a comb is drawn, along the structure's axis: per mm of the
/// play along x (u_mm) and y (v_mm).
[[nodiscard]] SheetPoint PlayAlong(const SheetPlan& plan, const Structure& structure,
                                   const Leg& leg);

/// By how much comb 1 was moved against comb 0 on purpose, along the measured axis.
[[nodiscard]] double Programmed_mm(const Structure& structure);

/// Least squares over all structures that could be read, weighted by the scatter of their fingers,
/// pooled by tool.
///
/// The bias is one per axis; where the controls say that it differs between + and - legs
/// (chi-square, 0.1 %), it is one per direction, which costs precision; so it always is on original
/// sheets with a control, whose tested combs never change sides. Where the structures
/// contradict each other beyond their scatter (chi-square, 1 %), all uncertainties grow by the
/// square root of the ratio.
///
/// On a photo lines of another height or colour are seen in another scale about the lens's foot
/// point or the picture's middle. Both are unknowns of each tool, from how its structures' offsets
/// differ and grow along them, and from what is taken for granted (RadialSpread). How large that is
/// follows from what was stated, as a scaled inverse chi-square of so many degrees of freedom,
/// and from what the lines show, so that lines more unlike than stated widen the intervals. What
/// the photo cannot tell of them is in the uncertainty. Several photos of one print see the same
/// ink, heights and colours from other places: what a structure reads differently in each tells of
/// those alone.
class SheetModel {
 public:
  SheetModel(const SheetPlan& plan, const std::vector<StructureReading>& structures,
             const RadialSpread& spread = {});
  /// @param photos  of one print, each with all structures in the plan's order; at least one.
  SheetModel(const SheetPlan& plan, const std::vector<const std::vector<StructureReading>*>& photos,
             const RadialSpread& spread);
  ~SheetModel();

  /// The combination's value; nothing where the readable structures do not determine it.
  [[nodiscard]] std::optional<Quantity> Estimate(const Combination& combination) const;
  /// The offset of a structure outside the model (self-test) without the method's bias.
  [[nodiscard]] std::optional<Quantity> WithoutBias(const SheetPlan& plan,
                                                    const StructureReading& reading) const;

  /// How unlike the tools' lines are on a photo, in parts of what was stated; 1 on a scan.
  [[nodiscard]] double line_spread() const;
  [[nodiscard]] double chi_square() const;
  [[nodiscard]] int freedom() const;
  [[nodiscard]] bool bias_by_direction() const;
  [[nodiscard]] bool widened() const;
  [[nodiscard]] double pooled_scatter_mm() const;  ///< of a finger

 private:
  struct Solution;
  std::unique_ptr<Solution> solution_;
};

}  // namespace trammel::tool_offset
