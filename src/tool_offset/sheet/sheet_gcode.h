// Writes the G-code of a sheet.
#pragma once

#include <string>

#include "tool_offset/sheet/sheet_plan.h"

namespace trammel::tool_offset {

/// Pattern file, and its cost.
struct SheetGcode {
  std::string text;
  double filament_mm = 0;  ///< total of all tools
  double time_s = 0;       ///< moves only: without heating, tool changes and the pause
  int tool_changes = 0;    ///< after the first
};

/// Time at which the paper is put on the bed.
enum class PaperComes {
  kInTheFile,  ///< the file homes, parks, waits until all is cold, and then for the paper
  kBefore,     ///< it lies there: whoever prints the file has done all that, and homes nothing now
};

// G-code for the steps outside such a file, as lines. REQUIRE as WriteSheetGcode.

/// Returns G-code that runs the sheet's start G-code and picks up the reference tool.
[[nodiscard]] std::string HomeAndPickUpGcode(const SheetPlan& plan);
/// Returns G-code that parks the homed head where hands can reach the bed (PaperParkOf).
[[nodiscard]] std::string ParkForPaperGcode(const SheetPlan& plan);
/// Returns G-code that parks the head beside the sheet, where it may heat.
[[nodiscard]] std::string ParkAsideGcode(const SheetPlan& plan);

/// Writes the sheet's G-code. Each tool is picked up once (and once more for each pick-up): the
/// reference tool first, which draws box, code and its combs, then every other with its combs.
/// Before each leg the nozzle travels the leg's own way, to take up the backlash of both axes. If
/// the paper is on the bed before, the file runs neither start nor end G-code and leaves the motors
/// on. It then ends with all heaters off and the head parked out of the way of hands. REQUIRES a
/// plan of PlanSheet, of settings without a problem.
[[nodiscard]] SheetGcode WriteSheetGcode(const SheetPlan& plan,
                                         PaperComes paper = PaperComes::kInTheFile);

/// Describes, in a sentence, the changes that persist after the print.
[[nodiscard]] std::string DescribeAfterwards(const SheetSettings& settings);

}  // namespace trammel::tool_offset
