// Which structures a sheet has, in the order in which they are spread over it.
#pragma once

#include <vector>

#include "tool_offset/sheet/sheet_plan.h"

namespace trammel::tool_offset {

/// All structures that measure along `axis`, not yet placed. The + structures of all tools come
/// before their - structures, controls and backlash evenly among them: placed in this order, what
/// belongs together never lies in one corner of the paper.
[[nodiscard]] std::vector<Structure> ListStructures(const SheetSettings& settings, Axis axis);

}  // namespace trammel::tool_offset
