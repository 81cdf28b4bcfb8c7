// Pictures of a page: a part of it as seen, and the sheet before it is printed.
#pragma once

#include "base/frame.h"
#include "base/page.h"
#include "document/canvas.h"
#include "tool_offset/reading/page.h"
#include "tool_offset/sheet/sheet_plan.h"

namespace trammel::report {

/// Where a parallelogram of the page lies on a canvas.
struct PageWindow {
  RectPx to;                      ///< on the canvas
  tool_offset::PagePoint origin;  ///< of the page, at the upper left corner of `to`
  tool_offset::PagePoint right;   ///< page px per px of the canvas to the right
  tool_offset::PagePoint down;    ///< and down

  /// Not finite where the window has no area.
  [[nodiscard]] PointPx At(tool_offset::PagePoint point) const;
};

/// The whole page, upright as it was scanned, as large as `room` allows, at its upper left corner.
[[nodiscard]] PageWindow WholePage(const PageView& page, const RectPx& room);

/// A piece of a structure, its measured axis to the right; seen from the side from which the page
/// was scanned.
/// @param from_mm, to_mm  along the measured axis, from the structure's middle; from < to.
/// @param to_rect         its height says how much of what lies beside the middle line is shown.
[[nodiscard]] PageWindow AlongStructure(const tool_offset::PageMap& map,
                                        const tool_offset::Structure& structure, double from_mm,
                                        double to_mm, const RectPx& to_rect);

/// Draws the page's pixels: means over what one pixel of the picture covers; grey beside the page.
void DrawPage(Canvas& canvas, const PageView& page, const PageWindow& window);

}  // namespace trammel::report
