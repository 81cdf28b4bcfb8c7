// Measures one finger on the scan: the positions of its two legs.
#pragma once

#include <array>
#include <optional>
#include <vector>

#include "tool_offset/reading/page.h"
#include "tool_offset/sheet/sheet_plan.h"

namespace trammel::tool_offset {

/// Length at each end of a leg, where the bead swells or starts late, that is not measured.
inline constexpr double kLegEnd_mm = 0.4;

/// Expected position and usable parts of a finger.
struct FingerSite {
  Axis axis = Axis::kX;  ///< along which it is measured; the legs run along the other
  /// Expected position of the finger along the axis, and the reference position along the legs, on
  /// the sheet.
  SheetPoint middle;
  double low_mm = 0;  ///< the legs' part to use, along them from the middle
  double high_mm = 0;
  double clear_low_mm = 0;  ///< the part where nothing else stands beside the finger
  double clear_high_mm = 0;
  /// Usable distance from the lower leg's middle down, and from the upper leg's up. Half of the way
  /// to the next ink (outside the clear part); at most half of the legs' distance.
  double free_low_mm = 0;
  double free_high_mm = 0;
};

struct LegReading {
  double position_mm = 0;  ///< from the site's middle, along the axis
  double slope = 0;        ///< mm along the axis per mm along the leg
  double ink_mm = 0;       ///< width of full ink that holds as much, median of the rows
  double scatter_mm = 0;   ///< robust standard deviation of the rows about the line
  int rows = 0;            ///< rows expected of the leg
  int rows_used = 0;       ///< complete and consistent rows
};

struct ReaderWorkspace {
  std::vector<float> samples;
  std::vector<float> profile;
  std::vector<double> along_mm;
  std::vector<double> place_mm;
  std::vector<double> ink;
  std::vector<double> scratch;
};

/// Searches for the finger's two legs near the site, in its clear part, where there is no other.
/// @param mix       the finger's ink is about 1 above its paper.
/// @param reach_mm  to either side of the site's middle.
/// @returns its place from the middle along the axis, to half a pixel; nothing if there are no
/// legs.
[[nodiscard]] std::optional<double> LocateFinger(const PageView& page, const ChannelMix& mix,
                                                 const PageMap& map, const SheetSettings& settings,
                                                 const FingerSite& site, double reach_mm,
                                                 ReaderWorkspace& workspace);

/// Reads both legs, the one with the lower coordinate first.
///
/// Each row of pixels across a leg yields the place that halves its ink. A robust straight line
/// through these, at the site's middle, is the leg's position: it ignores broken, blotted or merged
/// pieces. The clear part determines the paper's level on both sides, and its slope.
/// @param site  right to about 0.1 mm.
/// @returns nothing if the strip is partly outside the page; legs without ink have rows_used = 0.
/// Accuracy: below 0.1 µm on a clean scan (analyse_test).
[[nodiscard]] std::optional<std::array<LegReading, 2>> ReadLegs(
    const PageView& page, const ChannelMix& mix, const PageMap& map, const SheetSettings& settings,
    const FingerSite& site, ReaderWorkspace& workspace);

}  // namespace trammel::tool_offset
