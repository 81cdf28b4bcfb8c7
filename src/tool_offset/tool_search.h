// Roughly where a tool prints, however far off: from all its legs at once.
#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include "tool_offset/ink_raster.h"
#include "tool_offset/sheet_plan.h"

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

/// Where a tool may print: on the sheet, and the score there.
struct Candidate {
  SheetPoint shift;
  double score = -1;
};

struct ToolPlace {
  bool found = false;
  bool ambiguous = false;  ///< good enough, but another place is nearly as good
  /// Where the tool's lines lie minus where they were planned, on the sheet; to 0.2 mm.
  SheetPoint shift;
  /// Legs that are there less those that are not, over all; those that other ink covers are
  /// neither. -1 … 1.
  double score = -1;
  std::vector<Candidate> rivals;  ///< places elsewhere that are nearly as good, best first
  double share = 0;               ///< of the legs that can be judged, those that are there, 0 … 1
  int legs = 0;                   ///< that could be judged there: no other ink covers them
};

/// What is known of the sheet's ink before a tool is looked for.
class ToolSearch {
 public:
  /// @param raster  outlives the search.
  /// @param ink_strength  of the reference tool, in levels.
  ToolSearch(const InkRaster& raster, const SheetPlan& plan, double ink_strength);

  /// Looks for each tool by the place at which most of its legs are there and stand out.
  ///
  /// A leg is there where its line is inked along its length and paper lies on one side of it at
  /// least. What the reference tool and tools that were found have drawn is neither for nor
  /// against. A comb one pitch off has all its teeth but one in place, along the measured axis;
  /// its sheet's other axis has then less than half a leg, and tells. Combs of two tools can stand
  /// in for each other, each moved onto the other's: a place is then weighed together with where
  /// that leaves the other tools, since what drew a line is one of them.
  /// @param tools  to look for.
  [[nodiscard]] std::vector<ToolPlace> Find(const std::vector<int>& tools);

 private:
  /// Along v and along u: for a leg centred on each cell, its marks.
  using LegMarks = std::array<std::vector<std::int8_t>, 2>;

  [[nodiscard]] LegMarks Judge(const std::vector<std::uint8_t>& explained, double threshold) const;
  void Explain(int tool, SheetPoint shift, std::vector<std::uint8_t>& explained) const;
  [[nodiscard]] ToolPlace Look(int tool, const LegMarks& legs) const;
  /// Of tools at their best places, the sum of the scores, once another's ink is explained.
  [[nodiscard]] double ScoreOfOthers(const std::vector<int>& others, int tool, SheetPoint shift,
                                     double threshold) const;
  /// Whether a place stays ahead of its rivals when the ink that each takes is lost to the others.
  [[nodiscard]] bool IsClearTogether(int tool, const ToolPlace& place,
                                     const std::vector<int>& others, double threshold) const;

  /// Of a comb's legs at a shift against the paper beside them, levels; only where no known ink
  /// lies.
  [[nodiscard]] double Contrast(const ToolComb& comb, SheetPoint shift, double& open_cells) const;
  /// To a cell: where the contrast is highest, for each axis along it.
  [[nodiscard]] SheetPoint Refine(int tool, SheetPoint shift) const;

  const InkRaster& raster_;
  const SheetPlan& plan_;
  double ink_strength_;
  std::vector<std::uint8_t> explained_;  ///< cells whose ink belongs to a known line
};

}  // namespace trammel::tool_offset
