// Position of the sheet on the bed.
#pragma once

#include <array>
#include <optional>
#include <string>

#include "tool_offset/sheet/sheet_plan.h"

namespace trammel::tool_offset {

/// Point in the printer's own coordinates.
struct BedPoint {
  double x_mm = 0;
  double y_mm = 0;
};

/// Returns the corners of the printed area, prime lines included: counter-clockwise from low u, low
/// v.
/// @param width_mm, height_mm  of the box, as in SheetPlan.
[[nodiscard]] std::array<BedPoint, 4> SheetCorners(const SheetSettings& settings, double width_mm,
                                                   double height_mm);

/// Bounding box of those corners.
struct BedBounds {
  double min_x_mm = 0;
  double min_y_mm = 0;
  double max_x_mm = 0;
  double max_y_mm = 0;
};
[[nodiscard]] BedBounds SheetBounds(const SheetSettings& settings, double width_mm,
                                    double height_mm);

/// Returns the reach of the outermost corner, relative to the bed less its margin; at most 1 fits.
[[nodiscard]] double SheetReach(const SheetSettings& settings, double width_mm, double height_mm);

/// Paper for the print, around it on the bed.
struct PaperOnBed {
  std::string name;
  BedBounds bounds;
};
/// Returns the smallest paper for the sheet, of the A series or as named in the settings; nothing
/// if none is large enough.
[[nodiscard]] std::optional<PaperOnBed> PaperAround(const SheetPlan& plan);

/// Position of the nozzle while hands reach the bed: high above its back edge, or its parking one.
struct PaperPark {
  double x_mm = 0;
  double y_mm = 0;
  double z_mm = 0;
};
[[nodiscard]] PaperPark PaperParkOf(const SheetSettings& settings);

/// Converts a point of the sheet to the bed.
[[nodiscard]] BedPoint OnBed(const SheetPlan& plan, const SheetPoint& point);

}  // namespace trammel::tool_offset
