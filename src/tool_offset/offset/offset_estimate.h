#pragma once

#include "tool_offset/offset/sheet_model.h"
#include "tool_offset/reading/sheet_result.h"

namespace trammel::tool_offset {

/// Fills in every answer of a sheet whose structures have been read: offsets,
/// play, bias, scale, pick-ups, self-test, notices.
void EstimateOffsets(const SheetPlan& plan, SheetResult& result);

/// The same by a model that knows more than this result's structures.
void EstimateOffsets(const SheetPlan& plan, const SheetModel& model, SheetResult& result);

}  // namespace trammel::tool_offset
