// The sheet's number as it is printed.
#pragma once

#include <cstdint>
#include <optional>
#include <vector>

#include "tool_offset/reading/page.h"
#include "tool_offset/reading/page_map.h"
#include "tool_offset/sheet/sheet_plan.h"

namespace trammel::tool_offset {

struct CodeReading {
  std::vector<double> ink;  ///< of each cell's leg; about 1 where there is one
  std::vector<bool> dark;
  double contrast = 0;  ///< between dark and light cells; a printed code has at least 0.3
  std::optional<std::uint16_t> sheet_id;  ///< nothing where the check bits disagree
  int wrong_cells = 0;                    ///< that differ from the plan's
};

/// Reads the cells where the map puts them.
/// @param mix  ink is higher than paper, by about 1.
[[nodiscard]] CodeReading ReadCode(const PageView& page, const ChannelMix& mix,
                                   const SheetPlan& plan, const PageMap& map);

/// Whether the cells are the plan's, but for a few that are damaged. A tool far off may have
/// printed over them: that adds ink, and takes none away.
/// @param code  of ReadCode, with a contrast above 0.
[[nodiscard]] bool IsThisCode(const CodeReading& code, const SheetPlan& plan);

/// Whether the cells may be the plan's, with more lines missing than IsThisCode allows and none
/// added.
/// @param code  of ReadCode, with a contrast above 0.
[[nodiscard]] bool IsBrokenCode(const CodeReading& code, const SheetPlan& plan);

}  // namespace trammel::tool_offset
