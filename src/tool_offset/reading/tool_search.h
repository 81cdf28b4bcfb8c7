// Searches for a tool by all its legs, however far off it prints.
#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include "tool_offset/reading/ink_raster.h"
#include "tool_offset/reading/shift_scores.h"
#include "tool_offset/sheet/sheet_plan.h"

namespace trammel::tool_offset {

/// Cells that a tool's lines at one position would explain, by the axis that their combs measure.
struct PlaceClaim {
  std::array<std::vector<std::uint32_t>, 2> ink;  ///< cells of ink under its lines; each once
  std::array<double, 2> missing{};  ///< cells that its lines should have inked and did not
};

/// Choice of one tool's position.
struct PlaceChoice {
  int place = -1;  ///< index of the claim; -1: nowhere
  /// Number of cells explained less with this tool anywhere else or nowhere.
  double lead = 0;
  std::array<double, 2> own{};  ///< cells that it alone explains, less those missing
  /// Tool that explains most of the ink at its place as well, of its first if it has none; -1:
  /// none.
  int beside = -1;
};

/// Selects each tool's place so that the most ink is explained, once, with the fewest missing
/// lines.
///
/// Each line was drawn by one tool, so ink under two tools' lines counts once: a tool moved onto
/// another's lines explains nothing new, and its own lines remain unexplained.
/// @param claims  of each tool, at its possible places, the likeliest first.
/// @returns a choice for each tool, in order: a local optimum that no change of a single tool's
/// place improves, with all others at their best places then.
/// Cost: O((sum of the claims' cells) * (number of claims)).
[[nodiscard]] std::vector<PlaceChoice> ChoosePlaces(std::vector<std::vector<PlaceClaim>> claims);

struct ToolPlace {
  bool found = false;
  bool ambiguous = false;  ///< good enough, but another place is nearly as good
  int beside = -1;         ///< if ambiguous: the tool whose lines lie over those of this; -1: none
  /// Position of the tool's lines less the planned one, on the sheet; to 0.2 mm.
  SheetPoint shift;
  double share = 0;  ///< present share of the judgeable legs, 0 … 1
};

/// Search for tools in the sheet's ink.
class ToolSearch {
 public:
  /// @param raster  outlives the search.
  /// @param ink_strength  of the reference tool, in levels.
  ToolSearch(const InkRaster& raster, const SheetPlan& plan, double ink_strength);

  /// Finds all tools by the places at which they together explain the sheet's ink best.
  ///
  /// The reference tool's lines count neither for nor against. A comb one pitch off has all its
  /// teeth but one in place along the measured axis; but along the other axis its sheet then has
  /// less than half a leg, which shows the error. Combs of two tools can replace each other, each
  /// moved onto the other's: each line was drawn by one tool, so its ink then counts once, and the
  /// unexplained ink shows the error. A place is valid if no other explains the ink nearly as well,
  /// and if along each axis enough ink is the tool's alone.
  /// @param tools  to find.
  [[nodiscard]] std::vector<ToolPlace> Find(const std::vector<int>& tools);

 private:
  /// Searches once for all tools not found yet: true if more were found.
  bool LookOnce(const std::vector<int>& tools, double threshold, std::vector<ToolPlace>& places);

  void Explain(int tool, SheetPoint shift, std::vector<std::uint8_t>& explained) const;
  /// Returns the ink under a tool's lines at a shift that no known line explains.
  [[nodiscard]] PlaceClaim Claim(int tool, SheetPoint shift, double threshold) const;

  /// Counts unexplained cells of ink within the box, of those that claims count.
  [[nodiscard]] double InkLeft(const std::vector<std::uint8_t>& explained, double threshold) const;

  /// Contrast of a comb's legs at a shift to the paper beside them, levels; only outside known ink.
  struct LegContrast {
    double line = 0;
    double paper = 0;
    double open_cells = 0;  ///< in the lines
    [[nodiscard]] double contrast() const { return line - paper; }
    /// True if the paper has next to no ink: both legs of the fingers are at their positions.
    [[nodiscard]] bool paper_is_clean() const { return paper < 0.3 * line; }
  };
  [[nodiscard]] LegContrast Contrast(const ToolComb& comb, SheetPoint shift,
                                     const std::vector<std::uint8_t>& explained) const;
  /// True if all visible combs of a tool are equally dark: other tools' ink, mistaken for its own,
  /// covers some of them only in part.
  [[nodiscard]] bool IsEven(int tool, SheetPoint shift,
                            const std::vector<std::uint8_t>& explained) const;
  /// Finds the highest contrast to a cell, for each axis along it.
  [[nodiscard]] SheetPoint Refine(int tool, SheetPoint shift,
                                  const std::vector<std::uint8_t>& explained) const;

  const InkRaster& raster_;
  const SheetPlan& plan_;
  double ink_strength_;
  std::vector<std::uint8_t> explained_;  ///< cells whose ink belongs to a known line
};

}  // namespace trammel::tool_offset
