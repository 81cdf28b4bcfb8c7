// From the readings of a sheet to its answers.
#pragma once

#include "tool_offset/reading/sheet_result.h"

namespace trammel::tool_offset {

/// Fills in every answer of a sheet whose structures and coarse marks have been read: offsets,
/// play, bias, scale, pick-ups, self-test, notices.
void EstimateOffsets(const SheetPlan& plan, SheetResult& result);

}  // namespace trammel::tool_offset
