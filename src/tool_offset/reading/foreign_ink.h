// Ink that lies where a structure has none: of tools far off, of hairs, stains and folds.
#pragma once

#include <map>
#include <span>
#include <vector>

#include "tool_offset/reading/ink_raster.h"
#include "tool_offset/sheet/sheet_plan.h"

namespace trammel::tool_offset {

/// A line of a tool so far off that it may lie in a structure that is not its own.
struct ForeignLeg {
  int tool = 0;
  Leg leg;  ///< where it is
};

/// The lines of all tools that are further off than `near_mm`.
/// @param shift  of each tool that was found, on the sheet.
[[nodiscard]] std::vector<ForeignLeg> ForeignLegs(const SheetPlan& plan,
                                                  const std::map<int, SheetPoint>& shift,
                                                  double near_mm);

/// Whether a foreign line comes nearer than `clear_mm` to a finger, and whose; -1 where none does.
/// @param low, high  corners of the finger, on the sheet.
[[nodiscard]] int ForeignTool(std::span<const ForeignLeg> legs, SheetPoint low, SheetPoint high,
                              double clear_mm);

/// For each structure the part of its white that holds ink which belongs to no line of the sheet.
/// @param shift         of each tool that was found, the reference tool included.
/// @param ink_strength  of the reference tool, in levels.
[[nodiscard]] std::vector<double> StrayInk(const InkRaster& raster, const SheetPlan& plan,
                                           const std::map<int, SheetPoint>& shift,
                                           double ink_strength);

}  // namespace trammel::tool_offset
