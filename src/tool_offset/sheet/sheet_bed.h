// Where the sheet lies on the bed.
#pragma once

#include <array>
#include <optional>
#include <string>

#include "tool_offset/sheet/sheet_plan.h"

namespace trammel::tool_offset {

/// In the printer's own coordinates.
struct BedPoint {
  double x_mm = 0;
  double y_mm = 0;
};

/// The corners of all that is printed, prime lines included: counter-clockwise from low u, low v.
/// @param width_mm, height_mm  of the box, as in SheetPlan.
[[nodiscard]] std::array<BedPoint, 4> SheetCorners(const SheetSettings& settings, double width_mm,
                                                   double height_mm);

/// What encloses those corners.
struct BedBounds {
  double min_x_mm = 0;
  double min_y_mm = 0;
  double max_x_mm = 0;
  double max_y_mm = 0;
};
[[nodiscard]] BedBounds SheetBounds(const SheetSettings& settings, double width_mm,
                                    double height_mm);

/// How far out the outermost corner lies on the bed less its margin; at most 1 fits.
[[nodiscard]] double SheetReach(const SheetSettings& settings, double width_mm, double height_mm);

/// The paper that the print is meant for, around it on the bed.
struct PaperOnBed {
  std::string name;
  BedBounds bounds;
};
/// The smallest that takes the sheet, of the A series or what the settings name; nothing where none
/// does.
[[nodiscard]] std::optional<PaperOnBed> PaperAround(const SheetPlan& plan);

/// Where the nozzle waits while hands reach the bed: high above its back edge, or where it parks.
struct PaperPark {
  double x_mm = 0;
  double y_mm = 0;
  double z_mm = 0;
};
[[nodiscard]] PaperPark PaperParkOf(const SheetSettings& settings);

/// A point of the sheet on the bed.
[[nodiscard]] BedPoint OnBed(const SheetPlan& plan, const SheetPoint& point);

}  // namespace trammel::tool_offset
