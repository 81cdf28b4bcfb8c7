// Finds the approximate position of a tool, however far off: searched by all its legs, read from
// its combs.
#pragma once

#include <string>
#include <vector>

#include "tool_offset/reading/ink_raster.h"
#include "tool_offset/reading/page.h"
#include "tool_offset/sheet/sheet_plan.h"

namespace trammel::tool_offset {

struct CoarseReading {
  bool found = false;
  bool placed = false;  ///< `shift` says where its lines lie, if only to 0.2 mm where not found
  /// Position of the tool's lines less the planned one, on the sheet and by its map.
  SheetPoint shift;
  /// Shift minus the reference tool's, each in the structures that both share: free of the map's
  /// errors.
  SheetPoint from_reference;
  double standard_uncertainty_mm = 0;  ///< of each axis of from_reference
  /// Robust standard deviation of the positions of a comb's fingers, of the worst comb beside it
  /// too.
  double spread_mm = 0;
  double legs_share = 0;   ///< share of the tool's judgeable legs that are present
  bool ambiguous = false;  ///< two places are nearly as good
  int beside = -1;         ///< if not found: the tool whose lines hide its own; -1: none
  int legs = 0;            ///< judgeable legs
  double strength = 0;     ///< of its ink against distant paper, levels; like `ink`
  InkColour ink;           ///< if found; otherwise all zero
};

/// Finds each tool within kSearch_mm (tool_search.h) of its planned place, then reads its combs and
/// the reference tool's beside them finger by finger.
/// @param reference  the reference tool's ink.
/// @returns one reading for each of `tools`.
/// Accuracy: its interval covers 95 % (offset_study).
[[nodiscard]] std::vector<CoarseReading> ReadCoarsely(const PageView& page, const PageMap& map,
                                                      const SheetPlan& plan,
                                                      const InkRaster& raster,
                                                      const InkColour& reference,
                                                      const std::vector<int>& tools);

}  // namespace trammel::tool_offset
