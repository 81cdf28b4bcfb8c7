#pragma once

#include <array>
#include <optional>
#include <string>
#include <vector>

#include "base/page.h"
#include "document/page.h"
#include "tool_offset/report/offset_table.h"

namespace trammel::report {

// None names a value unless its verdict is good. Numbers that are not finite are left out.

/// "page": the whole scan, reduced, with the box and its corners, the sheet's axes, code,
/// structures, and fingers that were left out.
[[nodiscard]] Figure PageFigure(const PageView& page, const tool_offset::SheetPlan& plan,
                                const tool_offset::SheetResult& result);

/// "structure-" and its name: the teeth as they were located, at the scan's resolution; the combs'
/// ink, the teeth's displacement with the quadrature phase, and what the fit leaves of it.
/// REQUIRES reading to be one of result.structures.
[[nodiscard]] Figure StructureFigure(const PageView& page, const tool_offset::SheetPlan& plan,
                                     const tool_offset::SheetResult& result,
                                     const tool_offset::StructureReading& reading);

/// "tools": an arrow from the reference tool to where each tool lands. Nothing without a tool that
/// has an offset.
[[nodiscard]] std::optional<Figure> ToolArrowsFigure(const OffsetAnalysis& analysis);

/// "scans": what each of several scans says of each tool, against the answer. Nothing without
/// several scans, or without tested tools.
[[nodiscard]] std::optional<Figure> ToolScansFigure(const OffsetAnalysis& analysis);

/// "structures": what each structure of a scan says against all of them together.
[[nodiscard]] Figure StructureOffsetsFigure(const OffsetScan& scan);

/// A figure in the formats that are kept; far smaller than the strokes and pixels behind it.
struct DrawnFigure {
  std::string name;  ///< file name without ending, [a-z0-9_-]+
  std::string svg;   ///< a file
  /// With its caption, for a page, at each of kPhotoSteps; empty where no page is to show it.
  std::array<std::string, kPhotoSteps.size()> html = {};
};
[[nodiscard]] DrawnFigure Drawn(const Figure& figure);

/// What has to be drawn while the page is at hand.
struct OffsetScanPictures {
  DrawnFigure page;
  std::vector<DrawnFigure> structures;  ///< as in the result; the page shows few of them
};
/// Holds no more of the page at a time than one structure or a page of 1140 px.
[[nodiscard]] OffsetScanPictures DrawOffsetScan(const PageView& page,
                                                const tool_offset::SheetPlan& plan,
                                                const tool_offset::SheetResult& result);

}  // namespace trammel::report
