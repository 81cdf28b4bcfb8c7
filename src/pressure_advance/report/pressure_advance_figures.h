// The figures of a pressure-advance analysis: after the paper's figures 7 to 9 and 17, and the
// response fit. Each lives in a file of its own, figure_*.cc.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "base/frame.h"
#include "document/figure.h"
#include "pressure_advance/laser/height_map.h"
#include "pressure_advance/profile/analysis.h"

namespace trammel::report {

/// A line as the photo eye traced it, in px of the rectified picture.
struct TracedLine {
  double pressure_advance_s = 0;
  std::vector<PointPx> lower_edge;  ///< along the line
  std::vector<PointPx> upper_edge;
};

/// What the photo eye keeps for the report.
struct PhotoView {
  Frame rectified;
  std::vector<TracedLine> lines;
};

/// What a report is made from. Views are not owned and may be absent.
struct ReportInput {
  const pressure_advance::Analysis* analysis = nullptr;  ///< REQUIRED
  const pressure_advance::LaserScanView* scan = nullptr;
  const PhotoView* photo = nullptr;
};

// Each gives nothing where the input does not hold what it shows. None names an answer unless
// analysis->pressure_advance is good. No input makes them fail: counts that do not fit together, no
// lines, one line, gaps all over, equal values and values that are not finite are shown as far as
// they go.

/// "response": by how much each line's pressure advance was too low, against it, read at both speed
/// changes, with the fit. Positive: too low (CONVENTIONS.md).
[[nodiscard]] std::optional<Figure> ResponseFigure(const ReportInput& input);

/// "deviation": the paper's score with its cubic (figure 17).
[[nodiscard]] std::optional<Figure> DeviationFigure(const ReportInput& input);

/// "profiles": cross-section along every line, stacked by pressure advance.
[[nodiscard]] std::optional<Figure> ProfilesFigure(const ReportInput& input);

/// "height_maps": every line from above (figures 7 to 9).
[[nodiscard]] std::optional<Figure> HeightMapsFigure(const ReportInput& input);

/// "photo": the rectified picture with the traced lines.
[[nodiscard]] std::optional<Figure> PhotoFigure(const ReportInput& input);

/// All that the input allows, in the order of the report.
[[nodiscard]] std::vector<Figure> PressureAdvanceFigures(const ReportInput& input);

}  // namespace trammel::report
