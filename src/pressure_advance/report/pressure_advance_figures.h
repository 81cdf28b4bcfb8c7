// Draws the figures of a pressure-advance analysis: after the figures 7 to 9 and 17 of the paper,
// and the response fit.
#pragma once

#include <cstddef>
#include <optional>
#include <string>
#include <vector>

#include "document/figure.h"
#include "document/plot.h"
#include "pressure_advance/laser/plate.h"
#include "pressure_advance/photo/photo_eye.h"
#include "pressure_advance/profile/analysis.h"
#include "pressure_advance/profile/line_profile.h"

namespace trammel::report {

/// An analysis with what its reader keeps for the report.
struct AnalysisRun {
  pressure_advance::Analysis analysis;
  std::optional<pressure_advance::LaserScanView> scan;
  std::optional<pressure_advance::PhotoView> photo;
};

// Each gives nothing where the input does not hold what it shows. None names an answer unless
// analysis->pressure_advance is good. No input makes them fail: counts that do not fit together, no
// lines, one line, gaps all over, equal values and values that are not finite are shown as far as
// they go.

/// "response": by how much each line's pressure advance was too low, against it, read at both speed
/// changes, with the fit. Positive: too low (CONVENTIONS.md).
[[nodiscard]] std::optional<Figure> ResponseFigure(const AnalysisRun& input);

/// "deviation": the paper's score with its cubic (figure 17).
[[nodiscard]] std::optional<Figure> DeviationFigure(const AnalysisRun& input);

/// "profiles": cross-section along every line, stacked by pressure advance.
[[nodiscard]] std::optional<Figure> ProfilesFigure(const AnalysisRun& input);

/// "height_maps": every line from above (figures 7 to 9).
[[nodiscard]] std::optional<Figure> HeightMapsFigure(const AnalysisRun& input);

/// "photo": the rectified picture with the traced lines.
[[nodiscard]] std::optional<Figure> PhotoFigure(const AnalysisRun& input);

/// All that the input allows, in the order of the report.
[[nodiscard]] std::vector<Figure> PressureAdvanceFigures(const AnalysisRun& input);

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

/// Speed in mm/s over position, in mm or (in_mm = false) in line lengths. With length and
/// acceleration known, changes of speed take their way inside the faster segment; else they are
/// steps. Empty where the motion does not say enough.
[[nodiscard]] std::vector<DataPoint> SpeedAlongLine(const pressure_advance::LineMotion& motion,
                                                    bool in_mm);

}  // namespace trammel::report
