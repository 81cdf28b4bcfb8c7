// Writes the G-code of a sheet.
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

/// When the paper is laid on the bed.
enum class PaperComes {
  kInTheFile,  ///< the file homes, parks, waits until all is cold, and then for the paper
  kBefore,     ///< it lies there: whoever prints the file has done all that, and homes nothing now
};

// What such a file leaves to others, as lines of G-code. REQUIRE as WriteSheetGcode.

/// Runs the sheet's start G-code and picks up the reference tool.
[[nodiscard]] std::string HomeAndPickUpGcode(const SheetPlan& plan);
/// Parks the head, which is homed, where hands can reach the bed (PaperParkOf).
[[nodiscard]] std::string ParkForPaperGcode(const SheetPlan& plan);
/// Parks it beside the sheet, where it may heat.
[[nodiscard]] std::string ParkAsideGcode(const SheetPlan& plan);

/// Each tool is picked up once (and once more for each pick-up): the reference tool first, which
/// draws box, code and its combs, then every other with its combs. Before each leg
/// the nozzle travels the leg's own way, so that the play of both axes is taken up.
/// Of paper that lies there before, the file runs neither start nor end G-code, leaves the motors
/// on, and ends with all heaters off and the head parked out of the way of hands.
/// REQUIRES a plan of PlanSheet, of settings without a problem.
[[nodiscard]] SheetGcode WriteSheetGcode(const SheetPlan& plan,
                                         PaperComes paper = PaperComes::kInTheFile);

/// What the printed file leaves behind of what it changed, in a sentence.
[[nodiscard]] std::string DescribeAfterwards(const SheetSettings& settings);

}  // namespace trammel::tool_offset
