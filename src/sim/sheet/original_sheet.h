// Sheet of the method's published generator, redrawn from its published geometry: other combs, no
// code, no control, one serpentine for each comb.
#pragma once

#include <string>
#include <vector>

#include "sim/sheet/sheet_gcode.h"

namespace trammel::sim {

/// The defaults are the published ones.
struct OriginalSheet {
  std::vector<int> tools = {1, 2, 3, 4, 5};  ///< one to five, 0 … 7 each, one may come again
  int reference = 2;
  double rotation_rad = 0.261799387799149;  ///< print on the bed, 15 degrees
  PlaneMm centre;
  /// Intentional offsets, one for each of `tools` or none, along the print's own axes. The
  /// published program moves the whole print by the last of them.
  std::vector<PlaneMm> offsets;
  bool repaired = false;  ///< each tool's own combs are moved by its own offset instead
  double extrusion_multiplier = 1.1;
};

/// G-code for RepRapFirmware, arcs included. REQUIRES one to five tools, and an offset for each or
/// none.
[[nodiscard]] std::string OriginalGcode(const OriginalSheet& sheet);

}  // namespace trammel::sim
