// Scores every shift of a tool by the legs that would be inked.
#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include "tool_offset/reading/ink_raster.h"
#include "tool_offset/sheet/sheet_plan.h"
#include "tool_offset/sheet/sheet_settings.h"

namespace trammel::tool_offset {

/// How far off along the bed's axes a tool is looked for: beyond what is answered, so that one
/// further off is told from one that did not print.
inline constexpr double kSearch_mm = 15;

/// A structure's comb of one tool.
struct ToolComb {
  std::size_t structure = 0;  ///< in the plan
  std::size_t comb = 0;
};

/// The combs that show where a tool prints: those of its first pick-up beside the reference tool.
[[nodiscard]] std::vector<ToolComb> CombsOf(const SheetPlan& plan, int tool);

/// Where the middles of a comb's legs lie in the raster.
struct CombCells {
  bool along_v = true;                     ///< the legs run along v
  std::vector<std::array<int, 2>> middle;  ///< column, row
};

[[nodiscard]] CombCells CellsOf(const InkRaster& raster, const SheetPlan& plan,
                                const ToolComb& tool_comb, SheetPoint shift);

/// Where a tool may print, on the sheet.
struct Candidate {
  SheetPoint shift;
  /// Legs that are inked less those that are not, over all; those that known ink covers are
  /// neither. -1 … 1.
  double score = -1;
  double share = 0;  ///< of the legs that can be judged, those that are inked, 0 … 1
};

/// Marks of legs along v and along u.
using LegMarks = std::array<std::vector<std::int8_t>, 2>;

/// Finds the best shift of a tool within kSearch_mm, and all others that may be meant: more than a
/// line apart, best first.
/// @returns empty where nowhere enough of the tool's legs can be judged.
/// Cost: O(shifts * legs), on all processors.
[[nodiscard]] std::vector<Candidate> FindCandidates(const InkRaster& raster, const SheetPlan& plan,
                                                    const LegMarks& legs, int tool);

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
