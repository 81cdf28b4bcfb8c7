// Finds the sheet on a page: box, rotation and code.
#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <vector>

#include "base/result.h"
#include "tool_offset/reading/box_lines.h"
#include "tool_offset/reading/page.h"
#include "tool_offset/sheet/sheet_plan.h"

namespace trammel::tool_offset {

struct CodeReading {
  std::vector<double> ink;  ///< per cell's leg; about 1 if one is printed
  std::vector<bool> dark;
  double contrast = 0;  ///< between dark and light cells; a printed code has at least 0.3
  std::optional<std::uint16_t> sheet_id;  ///< nothing where the check bits disagree
  int wrong_cells = 0;                    ///< different from the plan's
};

/// Reads the code's cells by the map.
/// @param mix  ink is higher than paper, by about 1.
[[nodiscard]] CodeReading ReadCode(const PageView& page, const ChannelMix& mix,
                                   const SheetPlan& plan, const PageMap& map);

/// True if the cells match the plan's, but for a few damaged ones. A tool far off may have printed
/// over them: that adds ink, and removes none.
/// @param code  of ReadCode, with a contrast above 0.
[[nodiscard]] bool IsThisCode(const CodeReading& code, const SheetPlan& plan);

/// True if the cells may be the plan's, with more lines missing than IsThisCode allows and none
/// added.
/// @param code  of ReadCode, with a contrast above 0.
[[nodiscard]] bool IsBrokenCode(const CodeReading& code, const SheetPlan& plan);

/// Position of the sheet on the page, and its evidence.
struct SheetOnPage {
  PageMap map;
  std::array<PagePoint, 4> corners;   ///< box as first seen, page pixels
  std::vector<SidePoint> box_places;  ///< places on the outermost line
  double box_rms_mm = 0;              ///< of those against the map
  /// True if a side has lost one of its nested lines: the map may then be off by their distance.
  bool box_lacks_line = false;
  CodeReading code;
  ChannelMix reference_mix{};  ///< makes the reference tool's ink about 1 above its paper
  double angle_rad = 0;        ///< sheet's u axis on the page, counter-clockwise
};

/// Kind of a sheet's picture.
enum class PageKind {
  kScan,
  kPhoto,
};

/// Finds the box, its lines and the code.
///
/// Any resolution from about 300 dpi, any angle; dark on light, light on dark or in colour; oblique
/// up to about 40 degrees.
/// @param kind  for the words of a failure
/// Fails, with the remedy, if there is no box or only a part of one, more than one sheet, another
/// sheet, a mirrored scan, or an unreadable code.
[[nodiscard]] Result<SheetOnPage> FindSheet(const PageView& page, const SheetPlan& plan,
                                            PageKind kind = PageKind::kScan);

}  // namespace trammel::tool_offset
