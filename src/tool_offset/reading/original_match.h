// Tells which way round the sheet of the method's original generator lies.
#pragma once

#include "tool_offset/reading/page.h"
#include "tool_offset/reading/page_map.h"
#include "tool_offset/sheet/sheet_plan.h"

namespace trammel::tool_offset {

/// The box as a scan shows it: one bar of three lines that have run together.
[[nodiscard]] SheetPlan BarOf(const SheetPlan& plan);

/// Compares the ink where the reference tool's combs stand alone with the paper between them, each
/// beyond the reach of the tested combs. About 1 the right way round, 0 elsewhere.
/// @param mix  ink is about 1 above its paper.
[[nodiscard]] double ReferenceMatch(const PageView& page, const SheetPlan& plan,
                                    const ChannelMix& mix, const PageMap& map);

}  // namespace trammel::tool_offset
