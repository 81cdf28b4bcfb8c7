// The box's lines at full resolution: the map from the sheet to the page.
#pragma once

#include <array>
#include <optional>
#include <vector>

#include "tool_offset/reading/page.h"
#include "tool_offset/sheet/sheet_plan.h"

namespace trammel::tool_offset {

/// A place on one side of the box.
struct SidePoint {
  Side side = kLeft;
  double along_mm = 0;  ///< planned, from the side's middle
  PagePoint place;      ///< where the outermost line is
};

struct BoxFit {
  PageMap map;
  std::array<double, kSides> support{};  ///< part of each side where its lines were found
  std::array<double, kSides> whole{};    ///< part of that where none of them is missing
  double rms_mm = 0;                     ///< of the places on the lines against the map
  std::vector<SidePoint> places;         ///< on the outermost line, where it was found
};

/// Finds the box's lines around where `start` puts them and fits the map to them.
/// @param start  right to 1.5 mm; its bending is not used.
/// @param mix    ink is higher than paper, by about 1.
/// Accuracy: 5 µm rms on a clean sheet; sheet_finder_test holds the map to 30 µm.
[[nodiscard]] BoxFit FitBox(const PageView& page, const ChannelMix& mix, const SheetPlan& plan,
                            const PageMap& start);

/// How wide the box's lines are where they have run together into one bar, from its width.
/// @returns nothing where no bar lies along most of the box's sides.
[[nodiscard]] std::optional<double> MergedLineWidth_mm(const PageView& page, const ChannelMix& mix,
                                                       const SheetPlan& plan, const PageMap& start);

}  // namespace trammel::tool_offset
