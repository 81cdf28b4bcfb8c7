// Draws the figures of a pressure-advance analysis: the response fit, and after the figures 7 to 9
// of the paper.
#pragma once

#include <cstddef>
#include <optional>
#include <string>
#include <vector>

#include "document/figure.h"
#include "document/plot.h"
#include "pressure_advance/laser/plate.h"
#include "pressure_advance/photo/photo_reader.h"
#include "pressure_advance/profile/analysis.h"
#include "pressure_advance/profile/line_profile.h"

namespace trammel::report {

/// Photo without an answer, as it was taken.
struct RefusedPhoto {
  Frame picture;
  /// Around what was taken for the pattern, as parts of the picture's width and height; empty:
  /// nothing.
  std::vector<vision::PointPx> outline;
};

/// Analysis with the reader's data for the report.
struct AnalysisRun {
  pressure_advance::Analysis analysis;
  std::optional<pressure_advance::LaserScanView> scan = {};
  std::optional<pressure_advance::PhotoView> photo = {};
  std::vector<double> printed_s = {};  ///< values that were read beside the pattern; empty: none
  bool mirrored = false;               ///< the photo is, as the numbers beside the pattern show
  std::optional<RefusedPhoto> refused = {};  ///< in place of `photo`
};

// Each returns nothing if the input lacks its data. None shows an answer unless
// analysis->pressure_advance is good. No input makes them fail: mismatched counts, no lines, one
// line, gaps all over, equal values and values that are not finite are drawn as far as possible.

/// "response": by how much each line's pressure advance was too low, against it, read at both speed
/// changes, with the fit. Positive: too low (CONVENTIONS.md).
[[nodiscard]] std::optional<Figure> ResponseFigure(const AnalysisRun& input);

/// "profiles": cross-section along every line, stacked by pressure advance.
[[nodiscard]] std::optional<Figure> ProfilesFigure(const AnalysisRun& input);

/// "height_maps": every line from above (figures 7 to 9).
[[nodiscard]] std::optional<Figure> HeightMapsFigure(const AnalysisRun& input);

/// "photo": the rectified picture with the traced lines; a refused one with the outline of what was
/// seen.
[[nodiscard]] std::optional<Figure> PhotoFigure(const AnalysisRun& input);

/// Returns all figures that the input allows, in the order of the report.
[[nodiscard]] std::vector<Figure> PressureAdvanceFigures(const AnalysisRun& input);

/// "0.036", "0.0125": seconds with three or four decimals.
[[nodiscard]] std::string PressureAdvanceText(double seconds);

/// Returns the lines' indices by rising pressure advance, without values that are not finite. At
/// most `most` of them, evenly chosen with the first and the last.
[[nodiscard]] std::vector<std::size_t> LinesByPressureAdvance(
    const pressure_advance::Analysis& analysis, std::size_t most);

}  // namespace trammel::report
