// Finds the box's lines at full resolution: the map from the sheet to the page.
#pragma once

#include <array>
#include <optional>
#include <vector>

#include "tool_offset/reading/page.h"
#include "tool_offset/sheet/sheet_plan.h"

namespace trammel::tool_offset {

/// Point on one side of the box.
struct SidePoint {
  Side side = kLeft;
  double along_mm = 0;  ///< planned, from the side's middle
  PagePoint place;      ///< place on the outermost line
};

struct BoxFit {
  PageMap map;
  std::array<double, kSides> support{};  ///< part of each side where its lines were found
  std::array<double, kSides> whole{};    ///< part of that where none of them is missing
  double rms_mm = 0;                     ///< of the places on the lines from the map
  std::vector<SidePoint> places;         ///< found places on the outermost line
};

/// Finds the box's lines near their positions by `start` and fits the map to them.
/// @param start  right to 1.5 mm; its bending is not used.
/// @param mix    ink is higher than paper, by about 1.
/// Accuracy: 5 µm rms on a clean sheet; sheet_finder_test checks the map to 30 µm.
[[nodiscard]] BoxFit FitBox(const PageView& page, const ChannelMix& mix, const SheetPlan& plan,
                            const PageMap& start);

/// Computes the width of box lines that have merged into one bar, from its width.
/// @returns nothing without a bar along most of the box's sides.
[[nodiscard]] std::optional<double> MergedLineWidth_mm(const PageView& page, const ChannelMix& mix,
                                                       const SheetPlan& plan, const PageMap& start);

}  // namespace trammel::tool_offset
