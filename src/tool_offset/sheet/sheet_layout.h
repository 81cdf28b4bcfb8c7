// Sizes on the sheet, and where its blocks are put so that it takes little paper.
#pragma once

#include <array>
#include <cstddef>
#include <tuple>
#include <vector>

#include "tool_offset/sheet/sheet_plan.h"

namespace trammel::tool_offset {

inline constexpr int kBoxLines = 3;
/// From one leg of the code to the next, and how long one is: at 300 dpi 23 px and 47 px.
inline constexpr double kCodeCell_mm = 2;
inline constexpr double kCodeLeg_mm = 4;
/// From the box to the first row of prime lines, more than most tools are off; from row to row; and
/// from one to the next in a row.
inline constexpr double kPrimeGap_mm = 5;
inline constexpr double kPrimeRow_mm = 3;
inline constexpr double kPrimeLength_mm = 40;

/// How far prime lines reach below the box.
[[nodiscard]] double PrimeDepth_mm(const SheetSettings& settings);

/// Ink of one structure: along the axis that it measures, and across.
[[nodiscard]] double StructureLength_mm(const SheetSettings& settings);
[[nodiscard]] double StructureThickness_mm(const SheetSettings& settings);

/// A rectangle of equal cells, each of which takes one thing.
struct Grid {
  double left_mm = 0;  ///< of its first cell
  double bottom_mm = 0;
  double cell_width_mm = 0;
  double cell_height_mm = 0;
  int columns = 1;
  int rows = 1;

  [[nodiscard]] SheetPoint CellMiddle(int column, int row) const {
    return {left_mm + (column + 0.5) * cell_width_mm, bottom_mm + (row + 0.5) * cell_height_mm};
  }
};

/// Everything inside the box; the origin is the lower left corner of `width_mm` x `height_mm`.
struct Layout {
  double width_mm = 0;
  double height_mm = 0;
  Grid x_structures;
  Grid y_structures;
  Grid code;  ///< one cell, in the lower left corner
};

/// In the order of what matters: whether it leaves the bed, and the paper of the settings; which
/// paper takes it, the smallest first; how much of that.
using SheetCost = std::tuple<bool, bool, int, double>;
/// @param width_mm, height_mm  of the box.
[[nodiscard]] SheetCost CostOfSheet(const SheetSettings& settings, double width_mm,
                                    double height_mm);

/// Of the outlines that fit the bed and the paper (of all, where none does) the one that takes the
/// smallest sheet of paper, turned by the tilt, and of those the one with the smallest turned
/// outline. X structures stand in columns, Y structures in rows.
/// @param border_mm  what lies around the layout on each side: box, clearance.
[[nodiscard]] Layout ArrangeSheet(const SheetSettings& settings, int x_structures, int y_structures,
                                  double border_mm);

}  // namespace trammel::tool_offset
