// What the figures of a pressure-advance analysis share.
#pragma once

#include <cstddef>
#include <string>
#include <vector>

#include "document/plot.h"
#include "pressure_advance/laser/height_map.h"
#include "pressure_advance/report/pressure_advance_figures.h"

namespace trammel::report {

/// "0.036", "0.0125": seconds with three or four decimals.
[[nodiscard]] std::string PressureAdvanceText(double seconds);

/// Indices of the lines by rising pressure advance; values that are not finite are left out. At
/// most `most` of them, evenly picked with the first and the last.
[[nodiscard]] std::vector<std::size_t> LinesByPressureAdvance(
    const pressure_advance::Analysis& analysis, std::size_t most);

/// The maps to show: of the response eye, or of the paper's method where there are none.
[[nodiscard]] const std::vector<pressure_advance::HeightMap>* ShownHeights(
    const AnalysisRun& input);

/// One image row per row and one column per frame; NaN where no laser line was found. Empty where
/// the map's sizes do not fit its values.
[[nodiscard]] Grid HeightGrid(const pressure_advance::HeightMap& map);

/// How heights are written: in mm where the scan's scale is known.
struct HeightUnit {
  double per_px = 1;
  const char* label = "height (px)";
};
[[nodiscard]] HeightUnit HeightUnitOf(const AnalysisRun& input);

/// How well heights and areas are known in mm, as a sentence with a blank before it; empty where
/// they are in pixels.
[[nodiscard]] std::string ScaleWords(const pressure_advance::Analysis& analysis);

/// From the 1st to the 99th percentile of all maps, so that single outliers do not take the scale.
[[nodiscard]] Range HeightRange(const std::vector<pressure_advance::HeightMap>& maps);

/// The extent of a map along the line: positions in mm where known, else frame numbers.
struct MapExtent {
  Range range;
  std::string label;
};
[[nodiscard]] MapExtent ExtentOf(const pressure_advance::HeightMap& map);

}  // namespace trammel::report
