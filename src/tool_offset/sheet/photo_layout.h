// The arrangement of a sheet that is to be photographed.
#pragma once

#include <vector>

#include "tool_offset/sheet/sheet_layout.h"
#include "tool_offset/sheet/sheet_plan.h"

namespace trammel::tool_offset {

/// Everything inside the box; the origin is the lower left corner of `width_mm` x `height_mm`.
struct PhotoLayout {
  double width_mm = 0;
  double height_mm = 0;
  std::vector<SheetPoint> x_structures;  ///< middles, in the order that was given
  std::vector<SheetPoint> y_structures;
  SheetPoint code;  ///< middle of its row
};

/// Sets the two structures of a tool and axis at opposite places about one point, so that what
/// grows from there outwards alike (lines of another height, lateral colour) is seen in their
/// difference and not in their mean.
///
/// The X structures stand in two equal blocks, the Y structures in two others, around the middle
/// like the wings of a windmill; the code lies in a row below. Of all shapes of the blocks the one
/// that ArrangeSheet would choose, too.
/// @param x, y  the structures of each axis; see ListStructures.
[[nodiscard]] PhotoLayout ArrangeForPhoto(const SheetSettings& settings,
                                          const std::vector<Structure>& x,
                                          const std::vector<Structure>& y, double border_mm);

}  // namespace trammel::tool_offset
