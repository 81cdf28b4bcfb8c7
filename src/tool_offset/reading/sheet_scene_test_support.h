// A planned sheet as ink on a page, with everything a printer and a scanner may do to it.
#pragma once

#include <array>
#include <map>
#include <set>
#include <vector>

#include "base/random.h"
#include "support/paper_sheet.h"
#include "tool_offset/reading/page.h"
#include "tool_offset/sheet/sheet_plan.h"

namespace trammel::tool_offset {

struct SheetScene {
  support::PaperOptions paper;  ///< size chosen to fit the sheet
  double margin_mm = 8;         ///< around the turned sheet
  double angle_rad = 0;         ///< sheet's u axis on the page, counter-clockwise
  bool mirrored = false;
  double scale_u = 1;  ///< paper's own stretch
  double scale_v = 1;

  std::map<int, SheetPoint> offset_mm;            ///< per tool, bed axes: u_mm is dx, v_mm is dy
  std::map<int, std::array<double, 3>> tool_ink;  ///< blue, green, red
  std::set<int> silent_tools;                     ///< print nothing
  double backlash_x_mm = 0;
  double backlash_y_mm = 0;
  double placement_mm = 0;  ///< standard deviation of each leg, across itself
  double wrinkle_mm = 0;    ///< amplitude
  double wrinkle_length_mm = 52;
  std::vector<support::PaperStroke> more;  ///< page coordinates
};

struct ScannedScene {
  support::PaperPage page;
  [[nodiscard]] PageView view() const {
    return {page.pixels.data(), page.width, page.height, page.channels,
            std::ptrdiff_t{page.channels} * page.width};
  }
};

/// A scene's page coordinates of a place on the sheet, mm.
[[nodiscard]] std::array<double, 2> OnPaper_mm(const SheetPlan& plan, const SheetScene& scene,
                                               SheetPoint point);

/// Covers one line of one side of the box, but for its ends.
[[nodiscard]] support::PaperStroke PaperOverBoxLine(const SheetPlan& plan, const SheetScene& scene,
                                                    Side side, double inset_mm);

[[nodiscard]] ScannedScene Scan(const SheetPlan& plan, SheetScene scene, Random& random);

}  // namespace trammel::tool_offset
