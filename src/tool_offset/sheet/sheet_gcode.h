// The G-code that prints a sheet.
#pragma once

#include <string>

#include "tool_offset/sheet/sheet_plan.h"

namespace trammel::tool_offset {

/// A pattern file, and what it costs.
struct SheetGcode {
  std::string text;
  double filament_mm = 0;  ///< of all tools together
  double time_s = 0;       ///< of the moves alone: without heating, tool changes and the pause
  int tool_changes = 0;    ///< after the first
};

/// Each tool is picked up once (and once more for each pick-up): the reference tool first, which
/// draws box, code and its combs, then every other with its coarse mark and combs. Before each leg
/// the nozzle travels the leg's own way, so that the play of both axes is taken up.
/// REQUIRES a plan of PlanSheet, of settings without a problem.
[[nodiscard]] SheetGcode WriteSheetGcode(const SheetPlan& plan);

}  // namespace trammel::tool_offset
