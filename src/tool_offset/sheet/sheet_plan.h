// Plans a sheet of combs: structures, their legs and the code of the sheet.
#pragma once

#include <array>
#include <cstdint>
#include <string>
#include <vector>

#include "tool_offset/sheet/sheet_settings.h"

namespace trammel::tool_offset {

/// Point on the sheet: u to the right, v away from the user, (0, 0) in the middle of the outer box.
/// The bed's coordinates are the sheet's, turned counter-clockwise by the tilt about the middle.
struct SheetPoint {
  double u_mm = 0;
  double v_mm = 0;

  friend SheetPoint operator+(SheetPoint a, SheetPoint b) {
    return {a.u_mm + b.u_mm, a.v_mm + b.v_mm};
  }
};

/// Line, drawn from start to end.
struct Leg {
  SheetPoint start;
  SheetPoint end;
};

/// Sheet axis along which the combs step, and its bed axis: kX along u, kY along v.
enum class Axis { kX, kY };

/// Returns a point's coordinate along the axis that combs step, and across it; and the point of
/// both.
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

/// Comb of `teeth` fingers, each of two parallel legs drawn the same way, without a joint between
/// them.
struct Comb {
  int tool = 0;
  /// +1 or -1: direction of the bed axis that the structure measures while a leg is drawn; for the
  /// original generator's combs, the direction of their steps (original_sheet.h).
  int direction = 1;
  int pick_up = 0;        ///< number of times the tool was returned before drawing this
  SheetPoint programmed;  ///< Added to every leg on purpose (self-test); zero otherwise.
};

/// Two interlocked combs of equal pitch, shifted by half a pitch. Comb 0 extends from the low side
/// of the other sheet coordinate into the overlap, comb 1 from the high side.
struct Structure {
  std::string name;  ///< Unmistakable on a sheet: "T1 X+", "control Y-", "backlash X 1".
  Purpose purpose = Purpose::kTool;
  Axis axis = Axis::kX;
  SheetPoint middle;
  std::array<Comb, 2> combs;
  /// True if comb 0 reaches from the high side and comb 1 from the low side instead.
  bool swapped = false;
  /// Finger of each comb that lacks a leg, and is not measured; -1: all have both.
  std::array<int, 2> incomplete{-1, -1};

  [[nodiscard]] bool FromLowSide(std::size_t comb) const { return (comb == 0) != swapped; }
};

/// Maximum offset of a tool along each of the bed's axes that can be measured.
inline constexpr double kCoarseReach_mm = 10;
/// Limit on an original sheet, whose structures are nearer to each other.
inline constexpr double kOriginalReach_mm = 1.5;

/// Cell of the sheet's printed number, by the reference tool, in a row below everything else, from
/// low to high u (CodeCell). A dark cell has one leg along v, a light one is empty.
struct CodeCell {
  SheetPoint middle;
  bool dark = false;
};

/// Prime line, drawn outside the box, below it, after each pick-up of a tool.
struct PrimeLine {
  int tool = 0;
  int pick_up = 0;
  Leg leg;
};

struct SheetPlan {
  SheetSettings settings;
  double width_mm = 0;   ///< centre line of the outermost box, along u
  double height_mm = 0;  ///< and along v.
  std::vector<double>
      box_insets_mm;  ///< centre line of each nested box from the outermost; 0 first
  std::vector<Structure> structures;
  std::vector<CodeCell> code;
  std::vector<PrimeLine> prime_lines;
  std::uint16_t sheet_id = 0;  ///< value of the code: a check sum of all reference dimensions

  /// True if drawn by the method's original generator (original_sheet.h): each comb is one stroke,
  /// a finger's second leg runs back; there is no code, and neither id nor a structure that shows
  /// backlash.
  bool original = false;
  double leg_end_mm = 0.4;  ///< beside a leg's end is not measured: its bead swells or starts late
  double turn_mm = 0;       ///< how far ink extends beyond a leg's end, at its turn
  std::vector<std::string> notices;  ///< go with every result of such a sheet
};

/// Plans with as many teeth as fit the paper, down to kFewestTeethToFit: the plan's own settings
/// contain their number. REQUIRES settings without a problem. Deterministic: the same settings
/// yield the same sheet, and so do the plan's own.
[[nodiscard]] SheetPlan PlanSheet(const SheetSettings& settings);

/// True if all that is printed fits the paper of the settings, with its margin.
[[nodiscard]] bool FitsItsPaper(const SheetPlan& plan);

/// Returns the intersection of a finger's middle line with the structure's middle, along the
/// measured axis, without the programmed offset. In mm on the sheet.
/// @param finger  0 … teeth - 1, in order of the coordinate.
[[nodiscard]] double FingerPosition_mm(const SheetPlan& plan, const Structure& structure,
                                       std::size_t comb, int finger);

/// Returns both legs of a finger, the one with the lower coordinate first; with the programmed
/// offset.
[[nodiscard]] std::array<Leg, 2> FingerLegs(const SheetPlan& plan, const Structure& structure,
                                            std::size_t comb, int finger);

/// Returns straight pieces for the turns and spines that join a comb's legs; none if legs are not
/// joined.
[[nodiscard]] std::vector<Leg> JoinsOfComb(const SheetPlan& plan, const Structure& structure,
                                           std::size_t comb);

/// Returns all lines of a tool in the structures, beside them and outside the box, without box and
/// code.
[[nodiscard]] std::vector<Leg> LegsOfTool(const SheetPlan& plan, int tool);

/// Returns the leg shifted.
[[nodiscard]] Leg Shifted(const Leg& leg, const SheetPoint& by);

/// Returns the leg of a dark cell, along v.
[[nodiscard]] Leg CodeLeg(const SheetPlan& plan, const CodeCell& cell);

}  // namespace trammel::tool_offset
