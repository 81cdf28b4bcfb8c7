// Plans a sheet of combs: structures, their legs and the code of the sheet.
#pragma once

#include <array>
#include <cstdint>
#include <string>
#include <vector>

#include "tool_offset/sheet/sheet_settings.h"

namespace trammel::tool_offset {

/// On the sheet: u to the right, v away from the user, (0, 0) in the middle of the outer box. The
/// bed's coordinates are the sheet's, turned counter-clockwise by the tilt about the middle.
struct SheetPoint {
  double u_mm = 0;
  double v_mm = 0;

  friend SheetPoint operator+(SheetPoint a, SheetPoint b) {
    return {a.u_mm + b.u_mm, a.v_mm + b.v_mm};
  }
};

/// A line, drawn from start to end.
struct Leg {
  SheetPoint start;
  SheetPoint end;
};

/// Along which sheet axis the combs step, and which bed axis it stands for: kX along u, kY along v.
enum class Axis { kX, kY };

/// A point's coordinate along the axis that combs step, and across it; and the point of both.
[[nodiscard]] inline double Along(Axis axis, SheetPoint point) {
  return axis == Axis::kX ? point.u_mm : point.v_mm;
}
[[nodiscard]] inline double Across(Axis axis, SheetPoint point) {
  return axis == Axis::kX ? point.v_mm : point.u_mm;
}
[[nodiscard]] inline SheetPoint PointAt(Axis axis, double along_mm, double across_mm) {
  return axis == Axis::kX ? SheetPoint{along_mm, across_mm} : SheetPoint{across_mm, along_mm};
}

enum class Purpose {
  kTool,      ///< Reference tool against a tested one, equal directions.
  kControl,   ///< Reference tool against itself, equal directions: truly zero.
  kBacklash,  ///< Reference tool, + legs against - legs.
  kPickUp,    ///< A tool against itself after it was put back and picked up again.
  kSelfTest,  ///< Reference tool against itself, moved by a programmed offset.
};

/// One comb: `teeth` fingers, each of two parallel legs drawn the same way, without the piece that
/// would join them.
struct Comb {
  int tool = 0;
  /// +1 or -1: which way the bed axis that the structure measures moves while a leg is drawn.
  /// Of the original generator's combs: which way they are stepped (original_plan.h).
  int direction = 1;
  int pick_up = 0;        ///< How often the tool has been put back before it draws this.
  SheetPoint programmed;  ///< Added to every leg on purpose (self-test); zero otherwise.
};

/// Two interlocked combs of equal pitch, shifted by half a pitch. Comb 0 reaches from the low side
/// of the other sheet coordinate into the overlap, comb 1 from the high side.
struct Structure {
  std::string name;  ///< Unmistakable on a sheet: "T1 X+", "control Y-", "backlash X 1".
  Purpose purpose = Purpose::kTool;
  Axis axis = Axis::kX;
  SheetPoint middle;
  std::array<Comb, 2> combs;
  /// Whether comb 0 reaches from the high side and comb 1 from the low side instead.
  bool swapped = false;
  /// Of each comb the finger that lacks a leg, and is not measured; -1: all have both.
  std::array<int, 2> incomplete{-1, -1};

  [[nodiscard]] bool FromLowSide(std::size_t comb) const { return (comb == 0) != swapped; }
};

/// The most that a tool may be off along each of the bed's axes and still be answered.
inline constexpr double kCoarseReach_mm = 10;
/// On an original sheet, whose structures stand nearer to each other.
inline constexpr double kOriginalReach_mm = 1.5;

/// The sheet's number in print, by the reference tool: cells along a row below everything else,
/// from low to high u (CodeCell); a dark cell holds one leg along v, a light one stays empty.
struct CodeCell {
  SheetPoint middle;
  bool dark = false;
};

/// Drawn outside the box, below it, each time that a tool was picked up.
struct PrimeLine {
  int tool = 0;
  int pick_up = 0;
  Leg leg;
};

struct SheetPlan {
  SheetSettings settings;
  double width_mm = 0;   ///< Of the outermost box line's middle, along u
  double height_mm = 0;  ///< and along v.
  std::vector<double>
      box_insets_mm;  ///< Of each nested box's middle line from the outermost; 0 first.
  std::vector<Structure> structures;
  std::vector<CodeCell> code;
  std::vector<PrimeLine> prime_lines;
  std::uint16_t sheet_id = 0;  ///< What the code says: a check sum of all that is measured against.

  /// Drawn by the method's original generator (original_plan.h): each comb is one stroke, a
  /// finger's second leg runs back; there is no code, and neither id nor a structure that shows
  /// play.
  bool original = false;
  double leg_end_mm = 0.4;  ///< beside a leg's end is not measured: its bead swells or starts late
  double turn_mm = 0;       ///< how far ink reaches beyond a leg's end, where it turns
  std::vector<std::string> notices;  ///< go with every result of such a sheet
};

/// Plans with as many teeth as fit the paper, down to kFewestTeethToFit: the plan's own settings
/// have their number. REQUIRES settings without a problem. Deterministic: the same settings give
/// the same sheet, and so do the plan's own.
[[nodiscard]] SheetPlan PlanSheet(const SheetSettings& settings);

/// Whether all that is printed fits the paper of the settings, with its margin.
[[nodiscard]] bool FitsItsPaper(const SheetPlan& plan);

/// Where a finger's middle line crosses the structure's middle, along the measured axis, without
/// the programmed offset. In mm on the sheet.
/// @param finger  0 … teeth - 1, in order of the coordinate.
[[nodiscard]] double FingerPosition_mm(const SheetPlan& plan, const Structure& structure,
                                       std::size_t comb, int finger);

/// Both legs of a finger, the one with the lower coordinate first; with the programmed offset.
[[nodiscard]] std::array<Leg, 2> FingerLegs(const SheetPlan& plan, const Structure& structure,
                                            std::size_t comb, int finger);

/// Straight pieces for the turns and spines that join a comb's legs; none where legs are not
/// joined.
[[nodiscard]] std::vector<Leg> JoinsOfComb(const SheetPlan& plan, const Structure& structure,
                                           std::size_t comb);

/// Everything that a tool draws in the structures, beside them and outside the box, but for box and
/// code.
[[nodiscard]] std::vector<Leg> LegsOfTool(const SheetPlan& plan, int tool);

/// A leg somewhere else.
[[nodiscard]] Leg Shifted(const Leg& leg, const SheetPoint& by);

/// The leg of a dark cell, along v.
[[nodiscard]] Leg CodeLeg(const SheetPlan& plan, const CodeCell& cell);

}  // namespace trammel::tool_offset
