#pragma once

#include "tool_offset/offset/sheet_model.h"
#include "tool_offset/reading/sheet_result.h"

namespace trammel::tool_offset {

/// Computes every result of a sheet whose structures have been read: offsets, backlash, bias,
/// scale, pick-ups, self-test, notices.
void EstimateOffsets(const SheetPlan& plan, SheetResult& result);

/// Computes the results by a model of more data than this result's structures.
void EstimateOffsets(const SheetPlan& plan, const SheetModel& model, SheetResult& result);

}  // namespace trammel::tool_offset
