// The figures of a pressure-advance analysis: after the paper's figures 7 to 9 and 17, and the
// response fit. Each lives in a file of its own, figure_*.cc.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "document/figure.h"
#include "pressure_advance/laser/height_map.h"
#include "pressure_advance/photo/photo_eye.h"
#include "pressure_advance/profile/analysis.h"

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

}  // namespace trammel::report
