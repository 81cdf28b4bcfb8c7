// Draws a sheet of combs before it is printed: on the bed, and by itself.
#pragma once

#include "document/canvas.h"
#include "tool_offset/sheet/sheet_plan.h"

namespace trammel::report {

/// Draws three views: the sheet on the bed, turned; one structure close up with the direction of
/// every leg; and the whole sheet upright with the name of each structure. Each tool has its
/// colour. Write it with ToSvg() or ToPng(). REQUIRES a plan of PlanSheet.
[[nodiscard]] Canvas SheetPreview(const tool_offset::SheetPlan& plan);

}  // namespace trammel::report
