// Whether a leg is inked, at every place of the raster at once.
#pragma once

#include <cstdint>
#include <vector>

#include "tool_offset/reading/ink_raster.h"
#include "tool_offset/sheet/sheet_settings.h"

namespace trammel::tool_offset {

/// Full marks of a leg that no other ink covers.
inline constexpr int kWholeLeg = 32;

/// Marks each cell by the leg centred on it: how much of it can be judged (0 … kWholeLeg), negative
/// where it is not there. Beside the raster nothing can be judged for a leg.
/// @param along_v    whether the legs run along v; else along u.
/// @param explained  by cell: not 0 where ink belongs to a known line.
/// @param threshold  of ink, in levels.
[[nodiscard]] std::vector<std::int8_t> JudgeLegs(const InkRaster& raster,
                                                 const std::vector<std::uint8_t>& explained,
                                                 const SheetSettings& settings, bool along_v,
                                                 double threshold);

}  // namespace trammel::tool_offset
