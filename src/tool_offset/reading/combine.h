// Combines several scans of a sheet, and several sheets.
#pragma once

#include <span>
#include <vector>

#include "tool_offset/reading/sheet_result.h"

namespace trammel::tool_offset {

/// Offset of a tool from all scans.
struct CombinedTool {
  int tool = 0;
  Measured dx_mm;
  Measured dy_mm;
  bool coarse = false;  ///< every sheet gave coarse values only
  int sheets = 0;       ///< that gave a value
  /// Standard deviation between the scans of one sheet, pooled; 0 if no sheet has two. It is the
  /// scanner's share, because the ink does not change.
  SheetPoint scan_scatter_mm;
};

struct CombinedResult {
  std::vector<CombinedTool> tools;
  AxisPair backlash_mm;
  AxisPair control_bias_mm;
  AxisPair px_per_mm;
};

/// Combines scans of the same sheet (turned by 90° or 180° on the glass, say), then sheets.
///
/// Within a sheet the values of the scans are averaged. Their uncertainty remains that of one scan,
/// because they all show the same ink, with the scatter between the scans added: averaging reduces
/// the scanner's share, not the print's. Sheets are printed anew, so their uncertainties are
/// independent: the mean, weighted by them, becomes more certain. It becomes less certain if the
/// sheets differ by more than they should (chi-square, 1 %).
/// @param sheets  for each sheet the results of its scans; of the same plan. REQUIRES at least one
/// scan in each.
[[nodiscard]] CombinedResult Combine(std::span<const std::vector<SheetResult>> sheets);

}  // namespace trammel::tool_offset
