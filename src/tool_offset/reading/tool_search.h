// Searches for a tool by all its legs, however far off it prints.
#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include "tool_offset/reading/ink_raster.h"
#include "tool_offset/reading/shift_scores.h"
#include "tool_offset/sheet/sheet_plan.h"

namespace trammel::tool_offset {

/// What a tool's lines at one place would explain, by the axis that their combs measure.
struct PlaceClaim {
  std::array<std::vector<std::uint32_t>, 2> ink;  ///< cells of ink under its lines; each once
  std::array<double, 2> missing{};  ///< cells that its lines should have inked and did not
};

/// Of one tool.
struct PlaceChoice {
  int place = -1;  ///< index of the claim; -1: nowhere
  /// By how many cells everything is explained worse with this tool anywhere else or nowhere.
  double lead = 0;
  std::array<double, 2> own{};  ///< cells that it alone explains, less those missing
  /// The tool that explains most of the ink at its place as well, of its first where it has none;
  /// -1: none.
  int beside = -1;
};

/// Chooses each tool's place so that the most ink is explained, once, with the least missing.
///
/// Since each line was drawn by one tool, ink under two tools' lines counts once: a tool moved onto
/// another's lines explains nothing new, and leaves its own lines over.
/// @param claims  of each tool, at the places where it may be, the likeliest first.
/// @returns a choice for each tool, in order: a local optimum that no change of a single tool's
///          place improves, with all others put where they are best then.
/// Cost: O((sum of the claims' cells) * (number of claims)).
[[nodiscard]] std::vector<PlaceChoice> ChoosePlaces(std::vector<std::vector<PlaceClaim>> claims);

struct ToolPlace {
  bool found = false;
  bool ambiguous = false;  ///< good enough, but another place is nearly as good
  int beside = -1;         ///< if ambiguous: the tool whose lines lie over those of this; -1: none
  /// Where the tool's lines lie minus where they were planned, on the sheet; to 0.2 mm.
  SheetPoint shift;
  double share = 0;  ///< of the legs that can be judged, those that are there, 0 … 1
};

/// What is known of the sheet's ink before a tool is looked for.
class ToolSearch {
 public:
  /// @param raster  outlives the search.
  /// @param ink_strength  of the reference tool, in levels.
  ToolSearch(const InkRaster& raster, const SheetPlan& plan, double ink_strength);

  /// Looks for all tools by the places at which they together explain the sheet's ink best.
  ///
  /// What the reference tool has drawn counts neither for nor against. A comb one pitch off has all
  /// its teeth but one in place, along the measured axis; its sheet's other axis has then less than
  /// half a leg, and tells. Combs of two tools can stand in for each other, each moved onto the
  /// other's: since each line was drawn by one tool, its ink then counts once, and what nobody
  /// explains tells. A place counts where no other explains the ink nearly as well, and where along
  /// each axis enough ink is the tool's alone.
  /// @param tools  to look for.
  [[nodiscard]] std::vector<ToolPlace> Find(const std::vector<int>& tools);

 private:
  /// One look at all tools that were not found: true if more were.
  bool LookOnce(const std::vector<int>& tools, double threshold, std::vector<ToolPlace>& places);

  void Explain(int tool, SheetPoint shift, std::vector<std::uint8_t>& explained) const;
  /// The ink under a tool's lines at a shift that no known line explains.
  [[nodiscard]] PlaceClaim Claim(int tool, SheetPoint shift, double threshold) const;

  /// Cells of ink within the box that are not explained, of those that claims count.
  [[nodiscard]] double InkLeft(const std::vector<std::uint8_t>& explained, double threshold) const;

  /// A comb's legs at a shift against the paper beside them, levels; only where no known ink lies.
  struct LegContrast {
    double line = 0;
    double paper = 0;
    double open_cells = 0;  ///< of the lines
    [[nodiscard]] double contrast() const { return line - paper; }
    /// Whether the paper has next to no ink: both legs of the fingers are in their places.
    [[nodiscard]] bool paper_is_clean() const { return paper < 0.3 * line; }
  };
  [[nodiscard]] LegContrast Contrast(const ToolComb& comb, SheetPoint shift,
                                     const std::vector<std::uint8_t>& explained) const;
  /// Whether all of a tool's combs that can be seen are as dark as each other: other tools' ink,
  /// taken for its own, covers some of them in part.
  [[nodiscard]] bool IsEven(int tool, SheetPoint shift,
                            const std::vector<std::uint8_t>& explained) const;
  /// To a cell: where the contrast is highest, for each axis along it.
  [[nodiscard]] SheetPoint Refine(int tool, SheetPoint shift,
                                  const std::vector<std::uint8_t>& explained) const;

  const InkRaster& raster_;
  const SheetPlan& plan_;
  double ink_strength_;
  std::vector<std::uint8_t> explained_;  ///< cells whose ink belongs to a known line
};

}  // namespace trammel::tool_offset
