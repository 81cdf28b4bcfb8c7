// Roughly where a tool prints, however far off: its coarse mark.
#pragma once

#include <optional>

#include "tool_offset/ink_channel.h"
#include "tool_offset/page.h"
#include "tool_offset/page_map.h"
#include "tool_offset/sheet_plan.h"

namespace trammel::tool_offset {

struct CoarseReading {
  bool found = false;
  /// Where the mark's middle lies minus where it was planned, on the sheet.
  SheetPoint shift;
  /// Against the map; legs and their edges only.
  double standard_uncertainty_mm = 0;
  InkColour ink;             ///< where it was found; otherwise all zero
  double best_contrast = 0;  ///< the most that any place in reach showed, in levels
};

/// Finds the mark within kCoarseReach_mm of its planned place along both of the bed's axes.
///
/// Every shift is tried in every colour channel: the mean along the four legs' middles minus that
/// of the paper between and beside them; both pairs must show it. Then each pair is read like a
/// finger.
[[nodiscard]] CoarseReading ReadCoarseMark(const PageView& page, const PageMap& map,
                                           const SheetPlan& plan, const CoarseMark& mark);

}  // namespace trammel::tool_offset
