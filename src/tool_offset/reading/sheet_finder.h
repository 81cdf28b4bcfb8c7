// Finds the printed sheet on a scanned page.
#pragma once

#include <array>
#include <vector>

#include "base/result.h"
#include "tool_offset/reading/box_lines.h"
#include "tool_offset/reading/code_reader.h"
#include "tool_offset/reading/page.h"
#include "tool_offset/reading/page_map.h"
#include "tool_offset/sheet/sheet_plan.h"

namespace trammel::tool_offset {

/// Where the sheet lies on the page, and how that was found.
struct SheetOnPage {
  PageMap map;
  std::array<PagePoint, 4> corners;   ///< of the box as first seen, page pixels
  std::vector<SidePoint> box_places;  ///< on the outermost line
  double box_rms_mm = 0;              ///< of those against the map
  /// Whether a side has lost one of its nested lines: the map may then be off by their distance.
  bool box_lacks_line = false;
  CodeReading code;
  ChannelMix reference_mix{};  ///< makes the reference tool's ink about 1 above its paper
  bool ink_is_darker = true;   ///< than the paper
  double angle_rad = 0;        ///< of the sheet's u axis on the page, counter-clockwise
  int quarter_turns = 0;       ///< the same to the nearest quarter turn, 0 … 3
};

/// What a picture of the sheet is.
enum class PageKind {
  kScan,
  kPhoto,
};

/// Finds the box, its lines and the code.
///
/// Any resolution from about 300 dpi, any angle; dark on light, light on dark or in colour; seen
/// aslant up to about 40 degrees.
/// @param kind  for the words of a failure
/// Fails, with what to do about it, where there is no box or only a part of one, more than one
/// sheet, another sheet, a mirrored scan, or a code that cannot be read.
[[nodiscard]] Result<SheetOnPage> FindSheet(const PageView& page, const SheetPlan& plan,
                                            PageKind kind = PageKind::kScan);

}  // namespace trammel::tool_offset
