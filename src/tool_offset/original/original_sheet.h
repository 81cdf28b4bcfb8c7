// Reads the G-code of the method's original generator as a sheet.
#pragma once

#include <string>
#include <string_view>
#include <vector>

#include "base/result.h"
#include "tool_offset/sheet/sheet_plan.h"

namespace trammel::tool_offset {

/// Most pairs on the published sheets.
inline constexpr int kMaxOriginalPairs = 5;
inline constexpr int kHighestOriginalTool = 99;
inline constexpr double kOriginalLeg_mm = 6;

/// Differences between sheets of the published generator that affect a scan.
struct OriginalSheet {
  std::vector<int> tools = {1, 2, 3, 4, 5};  ///< per pair of structures, in order; 1 … 5
  int reference_tool = 2;                    ///< draws the box and one comb of every structure
  double rotation_deg = 15;                  ///< [5, 40] of the print on the bed
  /// Programmed offset of each pair's tested combs, along the print's axes; as many as tools.
  std::vector<SheetPoint> moved = std::vector<SheetPoint>(5);
};

/// Checks that a sheet is possible; the error names the first fault.
[[nodiscard]] Result<void> Validate(const OriginalSheet& sheet);

/// Plans the published geometry: u right, v up, the middle of the box at (0, 0). Y structures are
/// at low u, X structures at high u. Of each pair the first structure ("+") has the tested comb as
/// comb 0, from the low side; the second ("-"), drawn from its far end, as comb 1. So the tested
/// comb stays on its side and the combs change their order. A pair of the reference tool itself is
/// a control, or a self-test if it is moved on purpose. REQUIRES a valid sheet.
[[nodiscard]] SheetPlan PlanOriginal(const OriginalSheet& sheet);

/// True if the text has the original generator's comments before its combs.
[[nodiscard]] bool IsOriginalGcode(std::string_view gcode);

/// Reads the tools, the reference tool, the rotation on the bed and the programmed offset of each
/// pair from the moves. The place on the bed does not matter.
///
/// Compares every leg, in the file's order, with the published geometry. Errors name the line: a
/// word that is no number, a box or a leg elsewhere than the generator draws it, a comb of another
/// tool than its pair's, a truncated file.
/// Cost: one pass; memory for 1400 legs, whatever the file.
[[nodiscard]] Result<OriginalSheet> ReadOriginalGcode(std::string_view gcode);

}  // namespace trammel::tool_offset
