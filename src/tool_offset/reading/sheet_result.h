// What a scanned sheet says: values with their uncertainty, and everything behind them.
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
  double position_mm = 0;  ///< where it is minus where it was planned; with a programmed offset
  double residual_mm = 0;  ///< against the structure's fit
  std::string left_out;    ///< why it does not count; empty if it does
  PagePoint place;         ///< on the scan, where the finger crosses the structure's middle
  std::array<LegReading, 2> legs;
};

/// One structure. `offset` is where comb 1 lies minus where it would if it were drawn like comb 0,
/// along the measured axis of the sheet.
struct StructureReading {
  std::size_t structure = 0;  ///< in the plan
  std::string name;
  Measured offset_mm;  ///< its uncertainty: the fingers' scatter alone
  /// Of the offset, what a standard deviation of 1 of each finger of comb 0 and of comb 1 makes.
  std::array<double, 2> gain{};
  /// Of a photo: what the height and the colour of comb 1's lines do to the offset.
  std::optional<RadialLever> lever;
  /// Of a photo: how the displacement of comb 1 grows per mm along the axis, and what of it a
  /// standard deviation of 1 of each finger of comb 0 and of comb 1 makes.
  double growth = 0;
  std::array<double, 2> growth_gain{};
  double residual_rms_mm = 0;
  std::array<double, 2> comb_squares_mm2{};  ///< sums of squared residuals of each comb
  std::array<double, 2> comb_freedom{};      ///< and their degrees of freedom
  double stretch = 0;                        ///< of the paper along the axis, against the map
  std::array<int, 2> teeth_used{};
  std::array<std::string, 2> channel;  ///< each comb was read in
  std::array<ChannelMix, 2> mix{};     ///< with which it was; all zero where it was not read
  std::array<SheetPoint, 2> shift_mm;  ///< of each comb's tool as known before, on the sheet
  /// What all structures together say of this one's offset; absent where they do not determine it.
  std::optional<double> expected_mm;
  std::vector<FingerReading> fingers;
};

struct ToolReading {
  int tool = 0;
  Measured dx_mm;  ///< where its line lands minus where the reference tool's would, bed axes
  Measured dy_mm;
  bool coarse = false;           ///< too far off for its teeth: read from its combs as a whole
  std::string notice;            ///< advice that goes with a value
  SheetPoint coarse_mm;          ///< from the combs as a whole, bed axes (u is dx, v is dy)
  CoarseReading coarse_reading;  ///< where it prints roughly
};

/// A tool that was put back and picked up again, against itself before.
struct PickUpReading {
  int tool = 0;
  int pick_up = 1;
  Measured dx_mm;
  Measured dy_mm;
};

/// A structure with a programmed offset and how it was recovered.
struct SelfTestReading {
  std::string name;
  double programmed_mm = 0;  ///< of comb 1 against comb 0
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
  AxisPair control_bias_mm;  ///< of the method, along the sheet's u (x) and v (y)
  AxisPair px_per_mm;        ///< of the printed pitch on the scan, along u (x) and v (y)
  double page_dpi_x = 0;     ///< what the box says of the scan's resolution, along a row
  double page_dpi_y = 0;     ///< and down the page
  std::vector<StructureReading> structures;  ///< in the plan's order; all of them
  double reference_strength = 0;             ///< contrast of the reference tool's ink, levels
  double finger_scatter_mm = 0;              ///< pooled over all tools
  double chi_square_per_freedom = 1;         ///< of the sheet's model, given the fingers' scatter
  std::optional<PhotoOnPage> photo = {};     ///< of a photo: how it was taken
  std::vector<std::string> notices;
};

}  // namespace trammel::tool_offset
