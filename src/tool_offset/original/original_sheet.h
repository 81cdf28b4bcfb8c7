// The sheet of the method's original generator: what its owner can say of it, and what is where.
#pragma once

#include <string>
#include <vector>

#include "tool_offset/sheet/sheet_plan.h"

namespace trammel::tool_offset {

/// Of a list of tools, as many as the published sheets have.
inline constexpr int kMostOriginalPairs = 5;
inline constexpr int kHighestOriginalTool = 99;

/// All that differs between sheets of the published generator as far as a scan is concerned.
struct OriginalSheet {
  std::vector<int> tools = {1, 2, 3, 4, 5};  ///< of each pair of structures, in order; 1 … 5
  int reference_tool = 2;                    ///< draws the box and one comb of every structure
  double rotation_deg = 15;                  ///< [5, 40] of the print on the bed
  /// Of each pair, how far its tested combs are moved on purpose, along the print's axes; as many
  /// as tools.
  std::vector<SheetPoint> moved = std::vector<SheetPoint>(5);
  /// The tested combs were seen in G-code: `moved` is what the file prints. Otherwise it is what
  /// the published generator makes of its settings.
  bool from_gcode = false;
  /// Settings ask for offsets that the published generator does not print.
  bool offsets_not_printed = false;
};

/// The first thing that cannot be a sheet, as an error.
[[nodiscard]] Result<void> Validate(const OriginalSheet& sheet);

/// The published geometry: u right, v up, the middle of the box at (0, 0). Y structures stand at
/// low u, X structures at high u. Of each pair the first structure ("+") has the tested comb as
/// comb 0, from the low side; the second ("-"), drawn from its far end, as comb 1, so that the
/// tested comb keeps its side and the combs change their order. A pair of the reference tool
/// itself is a control, or a self-test where it is moved on purpose.
/// REQUIRES a valid sheet.
[[nodiscard]] SheetPlan PlanOriginal(const OriginalSheet& sheet);

/// Words on what cannot be told from this sheet, for every result of it.
[[nodiscard]] std::vector<std::string> OriginalNotices(const OriginalSheet& sheet);

}  // namespace trammel::tool_offset
