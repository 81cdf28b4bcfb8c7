#pragma once

#include <array>
#include <optional>
#include <string>
#include <vector>

#include "base/page.h"
#include "document/page.h"
#include "tool_offset/report/offset_table.h"

namespace trammel::report {

// The figures show a value only if its verdict is good. Numbers that are not finite are omitted.

/// "tools": an arrow from the reference tool to where each tool lands. Nothing without a tool that
/// has an offset.
[[nodiscard]] std::optional<Figure> ToolArrowsFigure(const OffsetAnalysis& analysis);

/// "scans": what each of several scans says of each tool, against the answer. Nothing without
/// several scans, or without tested tools.
[[nodiscard]] std::optional<Figure> ToolScansFigure(const OffsetAnalysis& analysis);

/// "structures": what each structure of a scan says against all of them together.
[[nodiscard]] Figure StructureOffsetsFigure(const OffsetScan& scan);

/// Figure in its output formats, far smaller than the strokes and pixels behind it.
struct DrawnFigure {
  std::string name;  ///< file name without ending, [a-z0-9_-]+
  std::string svg;   ///< a file
  /// With its caption, for a page, at each of kPhotoSteps; empty of a figure that is not of a page.
  std::array<std::string, kPhotoSteps.size()> html = {};
};
[[nodiscard]] DrawnFigure Drawn(const Figure& figure);

/// Draws "page": the whole scan, reduced, with the box and its corners, the sheet's axes, code,
/// structures, and fingers that were left out.
[[nodiscard]] DrawnFigure DrawnPage(const PageView& page, const tool_offset::SheetPlan& plan,
                                    const tool_offset::SheetResult& result);

}  // namespace trammel::report
