// Scores every shift of a tool by the legs that would be inked.
#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include "tool_offset/reading/ink_raster.h"
#include "tool_offset/sheet/sheet_plan.h"
#include "tool_offset/sheet/sheet_settings.h"

namespace trammel::tool_offset {

/// Search range for a tool along the bed's axes, wider than the range of answers. It separates a
/// tool farther off from one that did not print.
inline constexpr double kSearch_mm = 15;

/// Comb of one tool in a structure.
struct ToolComb {
  std::size_t structure = 0;  ///< index in the plan
  std::size_t comb = 0;
};

/// Returns the combs that show a tool's position: those of its first pick-up beside the reference
/// tool.
[[nodiscard]] std::vector<ToolComb> CombsOf(const SheetPlan& plan, int tool);

/// Middles of a comb's legs in the raster.
struct CombCells {
  bool along_v = true;                     ///< the legs run along v
  std::vector<std::array<int, 2>> middle;  ///< column, row
};

[[nodiscard]] CombCells CellsOf(const InkRaster& raster, const SheetPlan& plan,
                                const ToolComb& tool_comb, SheetPoint shift);

/// Possible printing position of a tool, on the sheet.
struct Candidate {
  SheetPoint shift;
  /// Inked minus missing legs, over all; legs covered by known ink count as neither. -1 … 1.
  double score = -1;
  double share = 0;  ///< inked share of the judgeable legs, 0 … 1
};

/// Marks of legs along v and along u.
using LegMarks = std::array<std::vector<std::int8_t>, 2>;

/// Finds the best shift of a tool within kSearch_mm, and all other plausible ones: more than a line
/// apart, best first.
/// @returns empty if too few of the tool's legs can be judged at every shift.
/// Cost: O(shifts * legs), on all processors.
[[nodiscard]] std::vector<Candidate> FindCandidates(const InkRaster& raster, const SheetPlan& plan,
                                                    const LegMarks& legs, int tool);

/// Mark of a leg that no other ink covers.
inline constexpr int kWholeLeg = 32;

/// Marks each cell by the leg centred on it: the visible part of it (0 … kWholeLeg), negative if
/// the leg is absent. Outside the raster no part is visible.
/// @param along_v    true if the legs run along v; else along u.
/// @param explained  by cell: not 0 where ink belongs to a known line.
/// @param threshold  of ink, in levels.
[[nodiscard]] std::vector<std::int8_t> JudgeLegs(const InkRaster& raster,
                                                 const std::vector<std::uint8_t>& explained,
                                                 const SheetSettings& settings, bool along_v,
                                                 double threshold);

}  // namespace trammel::tool_offset
