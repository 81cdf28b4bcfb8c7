// Result of a scanned sheet: values with their uncertainty, and everything behind them.
#pragma once

#include <array>
#include <optional>
#include <string>
#include <vector>

#include "base/measured.h"
#include "tool_offset/reading/coarse_reader.h"
#include "tool_offset/reading/leg_reader.h"
#include "tool_offset/reading/photo_map.h"
#include "tool_offset/reading/sheet_finder.h"
#include "tool_offset/sheet/sheet_plan.h"

namespace trammel::tool_offset {

/// A value with an interval of so many standard uncertainties to either side.
[[nodiscard]] inline Quantity Around(double value, double uncertainty, double factor) {
  return {value, uncertainty, {value - factor * uncertainty, value + factor * uncertainty}};
}

/// One finger of a comb.
struct FingerReading {
  std::size_t comb = 0;
  int finger = 0;
  double planned_mm = 0;   ///< along the measured axis, from the structure's middle
  double position_mm = 0;  ///< actual minus planned position; includes a programmed offset
  double residual_mm = 0;  ///< against the structure's fit
  std::string left_out;    ///< why it is not used; empty if used
  PagePoint place;         ///< on the scan, where the finger crosses the structure's middle
  std::array<LegReading, 2> legs;
};

/// Reading of a structure. `offset` is the position of comb 1 minus its position if it were drawn
/// like comb 0, along the measured axis of the sheet.
struct StructureReading {
  std::size_t structure = 0;  ///< index in the plan
  std::string name;
  Measured offset_mm;  ///< its uncertainty: the fingers' scatter alone
  /// Standard deviation of the offset per unit one of the fingers of comb 0 and of comb 1.
  std::array<double, 2> gain{};
  /// Effect of the height and the colour of comb 1's lines on the offset, in a photo.
  std::optional<RadialLever> lever;
  /// Growth of comb 1's displacement per mm along the axis, in a photo. Its gain is per unit
  /// standard deviation of the fingers of comb 0 and of comb 1.
  double growth = 0;
  std::array<double, 2> growth_gain{};
  double residual_rms_mm = 0;
  std::array<double, 2> comb_squares_mm2{};  ///< sums of squared residuals of each comb
  std::array<double, 2> comb_freedom{};      ///< and their degrees of freedom
  double stretch = 0;                        ///< paper stretch along the axis, relative to the map
  std::array<int, 2> teeth_used{};
  std::array<std::string, 2> channel;  ///< each comb was read in
  std::array<ChannelMix, 2> mix{};     ///< channels used for reading; all zero if not read
  std::array<SheetPoint, 2> shift_mm;  ///< of each comb's tool as known before, on the sheet
  /// Offset expected from all structures together; absent if they do not determine it.
  std::optional<double> expected_mm;
  std::vector<FingerReading> fingers;
};

struct ToolReading {
  int tool = 0;
  Measured dx_mm;  ///< actual line position minus that of the reference tool, bed axes
  Measured dy_mm;
  bool coarse = false;           ///< too far off for its teeth: read from its combs as a whole
  std::string notice;            ///< advice that goes with a value
  SheetPoint coarse_mm;          ///< from the entire combs, bed axes (u is dx, v is dy)
  CoarseReading coarse_reading;  ///< approximate place of its lines
};

/// Offset of a tool after it was put back and picked up again, relative to before.
struct PickUpReading {
  int tool = 0;
  int pick_up = 1;
  Measured dx_mm;
  Measured dy_mm;
};

/// Structure with a programmed offset, and the measured one.
struct SelfTestReading {
  std::string name;
  double programmed_mm = 0;  ///< comb 1 relative to comb 0
  Measured recovered_mm;
};

/// A value along each axis.
struct AxisPair {
  Measured x;
  Measured y;
};

struct SheetResult {
  SheetOnPage sheet;
  std::vector<ToolReading> tools;  ///< every tested tool, in the plan's order
  std::vector<PickUpReading> pick_ups;
  std::vector<SelfTestReading> self_tests;
  AxisPair backlash_mm;      ///< play of the bed's axes
  AxisPair control_bias_mm;  ///< method's bias, along the sheet's u (x) and v (y)
  AxisPair px_per_mm;        ///< from the printed pitch on the scan, along u (x) and v (y)
  double page_dpi_x = 0;     ///< scan's resolution along a row, from the box
  double page_dpi_y = 0;     ///< and down the page
  std::vector<StructureReading> structures;  ///< all, in the plan's order
  double reference_strength = 0;             ///< contrast of the reference tool's ink, levels
  double finger_scatter_mm = 0;              ///< pooled over all tools
  double chi_square_per_freedom = 1;         ///< sheet's model, given the fingers' scatter
  std::optional<PhotoOnPage> photo = {};     ///< for a photo: its pose and scale
  std::vector<std::string> notices;
};

}  // namespace trammel::tool_offset
